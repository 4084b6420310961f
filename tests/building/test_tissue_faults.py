"""`stereocell tissue OUT` is killed, on a full disk, or finds damaged files, and goes on later."""

import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.building import input_unchanged, model_process, phases
from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.engine.run import console
from stereocell.report import phase as report
from stereocell.steps import learn_tissue as learn_tissue_step
from stereocell.steps.open_source import forget_sources
from stereocell.storage.claim import LOCK
from stereocell.storage.documents import NOT_WRITTEN
from stereocell.tissue.classify import TissueOptions
from stereocell.verify import formats as check_module
from support import phantoms
from support.exhaustive import IS_EXHAUSTIVE, sweep
from support.onnx_models import write_model
from support.sealed_files import seal

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_node")]

Kill = Callable[[Path, list[str], tuple[str, str]], None]
TESTS = Path(__file__).parents[1]
REPORT = report.run_report
CHANNEL = "body"
QUICK = """
[lod]
errors = [1.0]
[unwrap]
max_texture = 64
"""
CHUNK = "tissue/classes.ome.zarr/0/c/1/0/0/0"
# each run gets a little further than the one before
FIRST_RUN = [
    ("open", "/.tissue.partial/classes.ome.zarr/0/c/1/0/0/0"),
    ("os.rename", "/tissue"),
    ("os.rename", "/plan.json"),
    ("os.rename", "/provenance.json"),
    ("os.rename", "/units/survey.json"),
    ("open", "/voxels.npz"),
    ("os.rename", "/units/done.json"),
    ("os.rename", "/stage/specimen.usdz"),
    ("os.rename", "/.bundle.old"),
]
OTHER_CLASSES = [
    ("os.rename", "/.tissue.old"),
    ("os.rename", "/tissue"),
    ("shutil.rmtree", "/.tissue.old"),
    ("os.rename", "/plan.json"),
]


@pytest.fixture(scope="module", autouse=True)
def learning_at_once() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            phases, "viewer_dist", lambda: None
        )  # as in the processes that the tests kill
        patch.setattr(learn_tissue_step, "learn_tissue", learn)
        yield


def learn(voxels: NDArray[Any], _: object, *, options: TissueOptions) -> SimpleNamespace:
    """Stand in for learning, which has its own tests: return classes by brightness."""
    count = int(options.classes)
    place = voxels / voxels.max() * (count - 1)
    shares = np.stack([np.clip(1 - np.abs(place - k), 0, 1) for k in range(count)])
    shares[:, voxels < np.median(voxels)] = 0
    means = np.stack([np.arange(count), np.ones(count)], axis=1)
    return SimpleNamespace(probabilities=shares.astype(np.float32), means=means, bic={count: 1.0})


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Skip the report, which takes longest and is written last."""
    monkeypatch.setattr(report, "run_report", lambda *_, **__: None)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished build of one channel."""
    folder = tmp_path_factory.mktemp("faults")
    (folder / "quick.toml").write_text(QUICK)
    body = phantoms.f_phantom(1)[None]
    source = phantoms.write_ome_tiff(folder / "f.ome.tif", body, "CZYX", names=[CHANNEL])
    given = ["-o", str(folder / "out"), "--config", str(folder / "quick.toml"), "--workers", "0"]
    assert main(["plan", str(source), *given[:-2]]) == 0
    for phase in ("units", "stage", "bundle"):
        assert main([phase, str(folder / "out"), "--workers", "0"]) == 0
    return folder / "out"


@pytest.fixture(scope="module")
def undisturbed(built: Path) -> Path:
    """A copy of `built` to which two classes were added without a fault."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "run_report", lambda *_, **__: None)
        out = copy(built, built.parent / "undisturbed")
        assert tissue(out) == 0
    return out


def copy(out: Path, to: Path, source: Path | None = None) -> Path:
    """Copy a build, and adapt the paths in its plan. `source`: where the input is copied to."""
    shutil.copytree(out, to)
    text = (to / "plan.json").read_text("utf-8").replace(f'"{out}', f'"{to}')
    if source is not None:
        shutil.copy(out.parent / "f.ome.tif", source)
        text = text.replace(f'"{out.parent / "f.ome.tif"}"', f'"{source}"')
    (to / "plan.json").write_text(json.dumps(seal(json.loads(text)), indent=1) + "\n")
    out_folder = OutFolder(to)
    out_folder.save_units(out_folder.plan(), out_folder.index())
    forget_sources()
    return to


def tissue(out: Path, *flags: str) -> int:
    return main(["tissue", str(out), *(flags or ("--classes", "2")), "--workers", "0"])


def digests(out: Path) -> dict[str, str]:
    """Return a digest of each file, without seconds and paths, so that OUT may lie anywhere."""
    found = {}
    for file in sorted(out.rglob("*")):
        if file.is_file() and file.name not in ("phases.json", "seconds.json", "plan.key"):
            content = file.read_bytes().replace(str(out).encode(), b"OUT")
            found[file.relative_to(out).as_posix()] = hashlib.sha256(content).hexdigest()
    return found


def remains(out: Path) -> list[Path]:
    return [file for file in out.rglob(".*") if not file.name.startswith((".z", ".nojekyll"))]


def faults(out: Path) -> list[str]:
    """Return the failed lines of the check, except for intact results of an earlier plan."""
    failed = [line for line in check_module.check(out) if not line.ok]
    stale = (": made from another ", ": began and did not finish: ")
    return [
        f"{line.name}: {line.detail}"
        for line in failed
        if line.name != "records" or not any(words in line.detail for words in stale)
    ]


def only_line(capfd: pytest.CaptureFixture[str]) -> str:
    """Return the only line of an error, without lines of progress."""
    printed = capfd.readouterr().err.splitlines()
    assert not [line for line in printed if "Traceback" in line]
    (line,) = [line for line in printed if line.startswith("stereocell: ")]
    return line


def run_until(out: str, flags: list[str], event: str, place: str) -> None:
    """Run `tissue` in this process, and kill the process at an event of Python's audit hooks.

    event  name of the audit event, such as os.rename
    place  end of the path that the event is about
    """

    def hook(name: str, arguments: tuple[Any, ...]) -> None:
        if name == event:
            path = arguments[1] if name == "os.rename" else arguments[0]
            is_read = name == "open" and "r" in str(arguments[1] or "")
            found = os.fsdecode(path) if isinstance(path, (str, os.PathLike)) else ""
            found = re.sub(r"\.[0-9a-f]{8}(?=\.(partial|old))", "", found)
            if not is_read and found.endswith(place):
                os.kill(os.getpid(), signal.SIGKILL)

    console.quiet = True
    phases.viewer_dist, report.run_report = (lambda: None), (lambda *_, **__: None)
    learn_tissue_step.learn_tissue = learn  # type: ignore[assignment]
    sys.addaudithook(hook)
    tissue(Path(out), *flags)


def fork_and_run() -> None:
    """Call `run_until` in a fork with the arguments in each line of the input; print exit codes."""
    for line in sys.stdin:
        child = os.fork()
        if child == 0:
            run_until(*json.loads(line))
            os._exit(0)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


@pytest.fixture(scope="module")
def kill() -> Iterator[Kill]:
    """Return a function that runs `tissue` in a process that is killed at a moment.

    The moment is an event and the end of a path, as in `run_until`. The test fails if the process
    does not reach it.
    """
    paths = os.pathsep.join(filter(None, [str(TESTS), os.environ.get("PYTHONPATH")]))
    with subprocess.Popen(
        [sys.executable, __file__],
        env={**os.environ, "PYTHONPATH": paths},
        text=True,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as server:
        assert server.stdin is not None
        assert server.stdout is not None

        def run(out: Path, flags: list[str], moment: tuple[str, str]) -> None:
            print(json.dumps([str(out), flags, *moment]), file=server.stdin, flush=True)
            assert int(server.stdout.readline()) == -signal.SIGKILL, moment

        yield run


def test_a_command_killed_at_any_moment_goes_on_to_the_same_bytes(
    built: Path, undisturbed: Path, tmp_path: Path, kill: Kill
) -> None:
    out = copy(built, tmp_path / "out")
    before = digests(out / "bundle")
    done: dict[Path, int] = {}
    for moment in FIRST_RUN if IS_EXHAUSTIVE else FIRST_RUN[::2]:
        kill(out, ["--classes", "2"], moment)
        assert digests(out / "bundle") == before
        assert {file: file.stat().st_mtime_ns for file in done} == done
        if moment[1] in ("/tissue", "/units/done.json"):  # the stage has not begun
            assert faults(out) == []
        records = (out / "units").rglob("unit.json")
        done |= {file: file.stat().st_mtime_ns for file in records if ".partial" not in str(file)}
    assert len(done) == 3  # the input's channel, two classes
    assert remains(out)
    assert tissue(out) == 0
    assert {file: file.stat().st_mtime_ns for file in done} == done
    assert remains(out) == []
    assert digests(out) == digests(undisturbed)
    assert faults(out) == []


def test_a_command_killed_while_it_replaces_classes_goes_on(
    undisturbed: Path, tmp_path: Path, kill: Kill
) -> None:
    asked = ["--classes", "3"]
    first, second = copy(undisturbed, tmp_path / "a"), copy(undisturbed, tmp_path / "b")
    for moment in OTHER_CLASSES:
        kill(first, asked, moment)
    assert tissue(first, *asked) == 0
    assert tissue(second, *asked) == 0
    assert remains(first) == []
    assert digests(first / "tissue") == digests(second / "tissue")
    assert digests(first / "bundle") == digests(second / "bundle")
    kill(first, ["--classes", "2"], ("shutil.rmtree", "/.tissue.old"))
    assert tissue(first) == 0
    assert remains(first) == []
    assert digests(first / "tissue") == digests(undisturbed / "tissue")
    assert digests(first / "bundle") == digests(undisturbed / "bundle")
    for word in ("old", "partial"):  # killed just before the old folder is removed
        shutil.copytree(first / "tissue", first / f".tissue.0123abcd.{word}")
    (first / LOCK).write_text("{}")
    assert tissue(first) == 0
    assert remains(first) == []


def test_a_full_disk_is_one_line_and_earlier_results_stay(
    built: Path, undisturbed: Path, small_disk: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    def resize(kilobytes: int) -> None:
        size = f"remount,size={kilobytes}k"
        subprocess.run(["mount", "-o", size, str(small_disk)], check=True)

    resize(512 << 10)
    out = copy(built, small_disk / "out")
    before, bundle = digests(out), digests(out / "bundle")
    codes = []
    for room in (0, 8, 40, 100, 300, 700, 1500):
        used = sum(-(-f.stat().st_size // 4096) * 4 for f in out.rglob("*") if f.is_file())
        resize(used + room)
        capfd.readouterr()
        codes.append(tissue(out))
        if codes[-1] == 0:
            break
        assert "No space left on device" in only_line(capfd)
        assert remains(out) == []
        assert digests(out / "bundle") == bundle
        if room <= 8:
            assert digests(out) == before
        if not (out / "tissue").exists() or room <= 40:  # with more room, the stage is begun
            assert faults(out) == []
    assert codes.count(1) >= 3
    resize(512 << 10)
    assert tissue(out) == 0
    assert digests(out) == digests(undisturbed)
    assert faults(out) == []


def cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def flip(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


@pytest.mark.parametrize(
    ("name", "damage"),
    sweep(
        [
            (CHUNK, cut),
            (CHUNK, flip),
            (CHUNK, Path.unlink),
            ("tissue/classes.ome.zarr/0/zarr.json", flip),
            ("tissue/tissue.json", cut),
            ("tissue/tissue.json", Path.unlink),
        ],
        kept=[(CHUNK, flip), (CHUNK, Path.unlink), ("tissue/tissue.json", cut)],
    ),
)
def test_a_damaged_file_is_reported_and_made_again(
    undisturbed: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    name: str,
    damage: Callable[[Path], None],
) -> None:
    out = copy(undisturbed, tmp_path / "out")
    monkeypatch.setattr(report, "run_report", REPORT)
    damage(out / name)
    (fault,) = faults(out)
    assert fault.startswith(f"tissue: {out / name}")
    unit = next((out / "units").rglob("tissue_x20_1"))
    unit.rename(tmp_path / "unit")  # the voxels are needed then
    for phase in (["units", "--workers", "0"], ["report"]):
        if phase[0] == "report":
            (tmp_path / "unit").rename(unit)
        capfd.readouterr()
        assert main([phase[0], str(out), *phase[1:]]) == 1
        line = only_line(capfd)
        assert str(out / name) in line
        assert f"run `stereocell tissue {out}` again" in line
    monkeypatch.setattr(report, "run_report", lambda *_, **__: None)
    assert tissue(out) == 0
    printed = capfd.readouterr().err
    assert Path(name).name in printed
    assert "OUT`" not in printed
    assert digests(out) == digests(undisturbed)
    assert faults(out) == []


def test_a_damaged_or_replaced_source_is_reported_and_nothing_is_changed(
    undisturbed: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "f.ome.tif"
    out = copy(undisturbed, tmp_path / "out", source)
    before = digests(out)
    other = phantoms.f_phantom(1)[None, :, :, ::-1]

    def replace(file: Path) -> None:
        phantoms.write_ome_tiff(file, other, "CZYX", names=[CHANNEL])

    for damage, words in (
        (replace, "f: changed since it was planned"),
        (cut, str(source)),
        (Path.unlink, f"{source}: not found"),
    ):
        damage(source)
        forget_sources()
        capfd.readouterr()
        assert tissue(out, "--classes", "3") == 1
        assert words in only_line(capfd)
        assert digests(out) == before
        assert remains(out) == []


def test_a_changed_dicom_source_is_reported_with_the_files_left_out(
    undisturbed: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    remarks = ("its label images: cells", "files left out: 1 cut short")
    left = SimpleNamespace(fingerprint="f" * 64, remarks=remarks)
    monkeypatch.setattr(input_unchanged, "open_watched", lambda ref: left)
    capfd.readouterr()
    assert tissue(undisturbed, "--classes", "3") == 1
    line = only_line(capfd)
    assert "f: changed since it was planned" in line
    assert "; files left out: 1 cut short)" in line
    assert "cells" not in line


def test_a_class_named_like_a_channel_is_refused_and_earlier_classes_stay(
    undisturbed: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = copy(undisturbed, tmp_path / "out")
    before = digests(out)
    model = write_model(tmp_path / "m.onnx", slopes=(-1.0, 1.0), names=["", CHANNEL])
    capfd.readouterr()
    assert tissue(out, "--model", str(model)) == 1
    assert f"found a channel with the name '{CHANNEL}', expected a name" in only_line(capfd)
    assert digests(out) == before
    assert (
        json.loads((out / "tissue" / "tissue.json").read_text("utf-8"))["settings"]["classes"] == 2
    )


@pytest.mark.parametrize("checked", ["by the command", "by the plan"])
def test_a_class_whose_name_no_plan_can_hold_is_refused_and_nothing_changes(
    undisturbed: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    checked: str,
) -> None:
    out = copy(undisturbed, tmp_path / "out")
    before = digests(out)
    model = write_model(tmp_path / "m.onnx", slopes=(-1.0, 1.0), names=["bone\x07", "marrow"])
    if checked == "by the plan":  # the name bypasses the model's own check
        monkeypatch.setattr(model_process, "_require_printable", lambda path, network: None)
    capfd.readouterr()
    assert tissue(out, "--model", str(model)) == 1
    line = only_line(capfd)
    assert "'bone\\x07', expected" in line
    assert "printable characters" in line
    assert (NOT_WRITTEN in line) == (checked == "by the plan")
    assert digests(out) == before


if __name__ == "__main__":
    fork_and_run()
