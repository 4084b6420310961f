"""Finished results stay, and missing, cut, edited or interrupted ones are noticed."""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.steps.open_source import forget_sources
from support import ctrl_c, phantoms
from support.digests import digests_of
from support.exhaustive import sweep
from support.server.timeouts import PATIENCE_S

pytestmark = pytest.mark.slow

BUILD = ["--workers", "0", "--grid", "2x1"]
UNIT = "r0_c0", "F_x20_body"


def _source(folder: Path) -> Path:
    body = phantoms.f_phantom()
    return phantoms.write_ome_tiff(
        folder / "f.ome.tif", np.stack([body, np.full_like(body, 300)]), "CZYX",
        names=["F body", "empty"],
    )  # fmt: skip


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("build")
    assert main(["build", str(_source(folder)), "-o", str(folder / "out"), *BUILD]) == 0
    return folder / "out"


@pytest.fixture
def out(built: Path, tmp_path: Path) -> Path:
    """A copy of a finished build; its source is the original one."""
    return shutil.copytree(built, tmp_path / "out")


@pytest.fixture
def source(built: Path) -> Path:
    return built.parent / "f.ome.tif"


def _unit(out: Path) -> Path:
    out_folder = OutFolder(out)
    return out_folder.unit_dir("/".join(UNIT), out_folder.index()["/".join(UNIT)])


def _cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def _go_on(out: Path) -> None:
    """Run the phases again, except the report, which takes longest."""
    for phase in ("units", "stage", "bundle"):
        assert main([phase, str(out), "--workers", "0"]) == 0


def _same(out: Path, built: Path) -> bool:
    return all(digests_of(out / part) == digests_of(built / part) for part in ("stage", "bundle"))


@pytest.mark.parametrize(
    "name",
    [
        "stage/tiles/r0_c1/tile.usdc",
        "stage/tiles/r0_c0/F_x20_body.exr",
        "bundle/manifest.json",
        "bundle/channels/F_x20_body/r0_c0/lod0.glb",
        "report/index.html",
        "UNIT/voxels.npz",
    ],
)
def test_cut_file_is_made_again(out: Path, built: Path, name: str) -> None:
    file = _unit(out) / Path(name).name if name.startswith("UNIT") else out / name
    size = file.stat().st_size
    _cut(file)
    if name.startswith("report"):
        assert main(["report", str(out)]) == 0
    _go_on(out)
    # Measured seconds in the file may have other digits.
    assert abs(file.stat().st_size - size) < 100
    assert _same(out, built)


@pytest.mark.parametrize(
    ("name", "content"),
    sweep(
        product(
            ["survey.json", "done.json", "evidence", "components", "window", "phases.json"],
            ["{}", "{ not JSON"],
        ),
        kept=[
            ("survey.json", "{}"),
            ("done.json", "{ not JSON"),
            ("evidence", "{ not JSON"),
            ("components", "{}"),
            ("window", "{}"),
            ("phases.json", "{ not JSON"),
        ],
    ),
)
def test_damaged_json_is_made_again_by_a_build_and_named_by_the_phase(
    out: Path, built: Path, capsys: pytest.CaptureFixture[str], name: str, content: str
) -> None:
    places = {
        "evidence": next((out / "units").rglob("evidence-*.json")),
        "components": next((out / "units").rglob("components-*.json")),
        "window": next((out / "units").glob("window-*.json")),
        "phases.json": out / "phases.json",
    }
    file = places.get(name, out / "units" / name)
    file.write_text(content)
    if name in ("survey.json", "done.json"):
        capsys.readouterr()
        for phase in (["stage", "--workers", "0"], ["report"]):
            assert main([phase[0], str(out), *phase[1:]]) == 1
            line = capsys.readouterr().err
            assert name in line
            assert f"run `stereocell units {out}`" in line
            assert "Traceback" not in line
    _go_on(out)
    assert json.loads(file.read_text("utf-8")) != json.loads("{}")
    assert _same(out, built)


def test_cut_unit_file_is_named_with_the_remedy(
    out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _cut(_unit(out) / "lod0.npz")
    (out / "phases.json").unlink()
    capsys.readouterr()
    assert main(["report", str(out)]) == 1
    lines = capsys.readouterr().err.splitlines()
    (line,) = [line for line in lines if line.startswith("stereocell: ")]
    assert "damaged" in line
    assert f"run `stereocell units {out}`" in line


def test_report_states_how_a_partial_run_spent_its_time(out: Path) -> None:
    shutil.rmtree(_unit(out))
    only = "/".join(UNIT)
    assert main(["units", str(out), "--workers", "0", "--only", only]) == 0
    assert main(["report", str(out)]) == 0
    assert "units (1 of 4 units)" in (out / "report" / "index.html").read_text("utf-8")


def test_source_that_was_replaced_since_the_plan_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = _source(tmp_path), tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out)]) == 0
    phantoms.write_ome_tiff(source, np.stack([phantoms.f_phantom()[:, :, ::-1]] * 2), "CZYX")
    forget_sources()  # as if the command ran in its own process
    capsys.readouterr()
    assert main(["units", str(out), "--workers", "0"]) == 1
    assert "f: changed since it was planned" in capsys.readouterr().err
    assert not list(out.rglob("unit.json"))


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--spacing-um", "1,1,1"], "with the file's own voxel spacing, not --spacing-um 1,1,1"),
        (["--time", "1"], "with --time 0, not 1"),
    ],
)
def test_used_out_names_the_flag_for_another_input(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], flags: list[str], words: str
) -> None:
    voxels = np.stack([phantoms.f_phantom(), phantoms.f_phantom()[:, ::-1]])
    source = phantoms.write_ome_tiff(tmp_path / "t.ome.tif", voxels, "TZYX")
    plan = ["plan", str(source), "-o", str(tmp_path / "out")]
    assert main(plan) == 0
    capsys.readouterr()
    assert main([*plan, *flags]) == 1
    assert words in capsys.readouterr().err


def test_stage_that_was_not_finished_is_not_exported(
    out: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = (_unit(out) / "voxels.npz").read_bytes()
    (_unit(out) / "voxels.npz").write_bytes(whole[:200])
    (out / "stage" / "stage.usda").unlink()
    assert main(["stage", str(out), "--workers", "0"]) == 1
    capsys.readouterr()
    assert main(["bundle", str(out), "--workers", "0"]) == 1
    assert (
        f"stage: began and did not finish: run `stereocell stage {out}`" in capsys.readouterr().err
    )
    assert main(["check", str(out)]) == 1
    (_unit(out) / "voxels.npz").write_bytes(whole)
    assert main(["stage", str(out), "--workers", "0"]) == 0
    assert main(["bundle", str(out), "--workers", "0"]) == 0


def test_run_of_one_unit_prints_how_many_are_missing(
    tmp_path: Path, source: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), "--grid", "2x1"]) == 0
    assert main(["units", str(tmp_path / "out"), "--workers", "0", "--only", "r0_c1/1"]) == 0
    assert "units: 3 of 4 units are not built yet" in capsys.readouterr().err


# The command interrupts itself and its worker when the worker writes. Even on a slow machine the
# phase is not done by then, because the worker waits before its last file.
_INTERRUPTED = """
import os, signal, sys, threading, time
from pathlib import Path
from stereocell.cli.__main__ import main
from stereocell.bundle import write as bundle

out = Path(sys.argv[1])
bundle.describe_bundle = lambda *_, **__: time.sleep(60)

def interrupt():
    while not list(out.glob(".bundle.*.partial/volumes/*/*")):
        time.sleep(0.001)
    if "SIGINT" in sys.argv[2]:
        os.killpg(0, signal.SIGINT)
        time.sleep(0.5)
    if "SIGTERM" in sys.argv[2]:
        os.kill(os.getpid(), signal.SIGTERM)

threading.Thread(target=interrupt, daemon=True).start()
sys.exit(main(["bundle", str(out), "--workers", "1"]))
"""


@pytest.mark.parametrize(
    ("start", "kind", "code"),
    [
        (ctrl_c.heeded, "SIGINT", 130),
        pytest.param(ctrl_c.heeded, "SIGTERM", 143, marks=pytest.mark.exhaustive),
        # A process in the background keeps ignoring SIGINT.
        (ctrl_c.ignored, "SIGINT, then SIGTERM", 143),
    ],
)
def test_interrupted_bundle_stops_at_once_and_leaves_nothing_half_written(
    out: Path, start: Callable[[], AbstractContextManager[None]], kind: str, code: int
) -> None:
    shutil.rmtree(out / "bundle")
    with start():
        bundle = subprocess.Popen(
            [sys.executable, "-c", _INTERRUPTED, str(out), kind],
            stderr=subprocess.PIPE,
            start_new_session=True,
            text=True,
        )
    try:
        _, printed = bundle.communicate(timeout=PATIENCE_S)
    finally:
        bundle.kill()
    assert bundle.returncode == code, printed
    assert printed.endswith("stereocell: stopped; the same command continues from here\n")
    assert "Traceback" not in printed
    assert not list(out.glob(".bundle*"))
    assert not (out / "bundle").exists()
