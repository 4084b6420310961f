"""Whole builds of small phantoms by the command line agree with the phantoms' known shapes."""

import json
import shutil
import subprocess
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pxr import Usd, UsdGeom
from threadpoolctl import threadpool_limits

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.engine.run import Engine
from stereocell.steps import write_stage_tile
from stereocell.steps.unit_files import load_record
from stereocell.steps.write_stage_tile import StageTile, WriteStageTile
from support import phantoms
from support.digests import digests_of
from support.exhaustive import sweep
from support.sealed_files import edit_sealed
from support.validators import make_assets

pytestmark = pytest.mark.slow


class WorkerDiedError(Exception):
    pass


BUILD = ["--workers", "0", "--grid", "2x1"]


def _two_channels() -> NDArray[np.uint16]:
    body = phantoms.f_phantom()
    return np.stack([body, np.full_like(body, 300)])


def _source(path: Path) -> Path:
    return phantoms.write_ome_tiff(
        path / "f.ome.tif", _two_channels(), axes="CZYX", names=["F body", "empty"]
    )


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("build")
    with threadpool_limits(2):  # workers have one thread each
        assert main(["build", str(_source(folder)), "-o", str(folder / "out"), *BUILD]) == 0
    return folder / "out"


def test_build_leaves_all_results(built: Path) -> None:
    parts = ("stage/stage.usda", "stage/specimen.usdz", "report/index.html")
    for name in ("plan.json", "provenance.json", *parts):
        assert (built / name).is_file(), name
    assert (built / "bundle" / "manifest.json").is_file()
    assert not [f for f in built.rglob("*") if f.name.startswith(".")]


def test_empty_channel_has_no_surface_and_says_why(built: Path) -> None:
    out_folder = OutFolder(built)
    for name, key in out_folder.index().items():
        tile, channel = name.split("/")
        record = load_record(out_folder.unit_dir(f"{tile}/{channel}", key))
        assert bool(record["reason"]) == (channel == "empty")
    reason = out_folder.survey()["empty"]["appearance"]["surface_reason"]
    assert reason.startswith("no clear surface: nothing stands out")


def test_f_is_upright_and_not_mirrored_in_the_composed_stage(built: Path) -> None:
    stage = Usd.Stage.Open(str(built / "stage" / "stage.usda"))
    points = []
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            matrix = UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(0)
            points += [matrix.Transform(p) for p in UsdGeom.Mesh(prim).GetPointsAttr().Get()]
    x, y, z = np.array(points).T
    # A voxel is 0.2 um along x and y, and 0.5 um along z. The stem has voxels 6..13, and arms end
    # at 30. Rows are 6..42, and the foot starts at plane 8. The surface is half-way between the
    # last voxel outside and the first inside, to half a voxel.
    assert 5.5 * 0.2 - 0.11 < x.min() < 5.5 * 0.2 + 0.11
    assert 29 * 0.2 - 0.2 < x.max() < 30 * 0.2 + 0.2
    assert -42 * 0.2 - 0.2 < y.min() < -41 * 0.2 + 0.2
    right = x > 26 * 0.2
    assert y[right].min() > -14 * 0.2  # only the top arm reaches far right
    foot = z > 9 * 0.5
    assert y[foot].max() < -32 * 0.2  # the foot is at the bottom, nearer to the viewer
    assert x[foot].max() < 14 * 0.2


def test_tiff_and_zarr_of_the_same_voxels_give_the_same_surface(
    built: Path, tmp_path: Path
) -> None:
    source = phantoms.write_ome_zarr(
        tmp_path / "f.ome.zarr",
        [_two_channels()],
        axes="czyx",
        version="0.5",
        scales=[{"z": 0.5, "y": 0.2, "x": 0.2}],
        channels=[{"label": "F body"}, {"label": "empty"}],
    )
    out = tmp_path / "out"
    assert make_assets(source, out, "2x1", "--workers", "0") == 0
    for lod in ("lod0.glb", "lod3.glb"):
        file = f"bundle/channels/F_x20_body/r0_c0/{lod}"
        assert (out / file).read_bytes() == (built / file).read_bytes()


def asset_digests(out: Path) -> dict[str, str]:
    return {
        name: digest
        for name, digest in digests_of(out).items()
        if name.startswith(("units/", "stage/", "bundle/"))
        # plan.key depends on the path of the source.
        and not name.endswith(("seconds.json", "plan.key"))
    }


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("workers", sweep(["1", "2"], kept=["2"]))
def test_number_of_workers_does_not_change_the_bytes(
    built: Path, tmp_path: Path, workers: str
) -> None:
    # One command shares workers between phases, because starting them takes longest.
    arguments = ["-o", str(tmp_path / "out"), "--grid", "2x1", "--workers", workers]
    assert main(["build", str(_source(tmp_path)), *arguments]) == 0
    assert asset_digests(tmp_path / "out") == asset_digests(built)


def test_the_same_input_in_any_order_gives_the_same_bytes(
    built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    in_order = Engine._outcomes
    asked = []

    def backwards(self, function, tasks, needs):
        asked.append(len(tasks))
        last = len(tasks) - 1
        for place, result, error in in_order(self, function, tasks[::-1], needs):
            yield last - place, result, error

    monkeypatch.setattr(Engine, "_outcomes", backwards)
    assert make_assets(_source(tmp_path), tmp_path / "out", "2x1", "--workers", "0") == 0
    # windows, evidence, components of the channel with a surface, units, parts of the stage
    assert asked[:5] == [2, 4, 2, 4, 4]
    assert asset_digests(tmp_path / "out") == asset_digests(built)
    names = {Path(name).name for name in asset_digests(built)}
    assert names >= {"unit.json", "lod0.npz", "voxels.npz", "stage.usda", "manifest.json"}
    assert list((built / "units").rglob("seconds.json"))


def test_a_worker_that_dies_while_it_joins_a_tile_is_replaced(
    built: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    join, run, dead = write_stage_tile.write_tile, WriteStageTile.run, []

    def die_once(*args, parts, **kwargs):
        if parts and not dead:
            dead.append(True)
            for part, written in parts.items():  # moved where a file system has no hard links
                for name in written.files:
                    (part / name).unlink()
            raise WorkerDiedError
        return join(*args, parts=parts, **kwargs)

    def again(self: WriteStageTile) -> StageTile:
        with suppress(WorkerDiedError):
            return run(self)
        return run(self)

    monkeypatch.setattr(write_stage_tile, "write_tile", die_once)
    monkeypatch.setattr(WriteStageTile, "run", again)
    assert make_assets(_source(tmp_path), tmp_path / "out", "2x1", "--workers", "0") == 0
    assert dead
    assert asset_digests(tmp_path / "out") == asset_digests(built)


def test_same_build_again_does_nothing(
    built: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = _source(tmp_path), tmp_path / "out"
    shutil.copytree(built, out)
    units = {f: f.stat().st_mtime_ns for f in out.rglob("unit.json")}
    assert units
    for phase in ("units", "stage"):
        assert main([phase, str(out), "--workers", "0"]) == 0
        assert f"{phase}: up to date" in capsys.readouterr().err
    assert main(["build", str(source), "-o", str(out), *BUILD]) == 0  # a copy of the same input
    assert {f: f.stat().st_mtime_ns for f in out.rglob("unit.json")} == units


def test_lost_unit_alone_is_built_again(built: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(built, out)
    out_folder = OutFolder(out)
    key = out_folder.index()["r0_c1/F_x20_body"]
    lost, kept = (out_folder.unit_dir(f"{tile}/F_x20_body", key_) for tile, key_ in
                  (("r0_c1", key), ("r0_c0", out_folder.index()["r0_c0/F_x20_body"])))  # fmt: skip
    shutil.rmtree(lost)
    stamp = (kept / "unit.json").stat().st_mtime_ns
    edit_sealed(out / "plan.json", lambda plan: plan.update(source=str(_source(tmp_path))))
    assert main(["units", str(out), "--workers", "0", "--only", "r0_c1/F body"]) == 0
    assert (lost / "unit.json").is_file()
    assert (kept / "unit.json").stat().st_mtime_ns == stamp


def test_given_iso_value_is_in_units_of_the_source_voxels(tmp_path: Path) -> None:
    source, out = _source(tmp_path), tmp_path / "out"
    flags = ["--grid", "1x1", "--iso-value", "F body=400"]
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    channel = OutFolder(out).survey()["F_x20_body"]
    iso = channel["iso"]["r0_c0"]
    assert iso["value"] == 400
    assert iso["background"] == 0
    # A level that the user gives has no confidence, but its alternatives are listed.
    assert iso["confidence"] is None
    assert channel["appearance"]["surface"] == "clear"
    assert channel["levels"]


# --- bad input: one line, exit code, nothing half-written


def _one_line(capsys: pytest.CaptureFixture[str]) -> str:
    """Return the printed error, without the lines of the phases."""
    lines = capsys.readouterr().err.splitlines()
    errors = [line for line in lines if line.startswith("stereocell: ")]
    assert len(errors) == 1, lines
    assert "Traceback" not in "\n".join(lines)
    return errors[0]


def test_build_of_another_input_into_a_used_out_is_refused(
    built: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    other = phantoms.write_ome_tiff(tmp_path / "other.ome.tif", _two_channels()[:, :, ::-1], "CZYX")
    before = digests_of(built)
    assert main(["build", str(other), "-o", str(built), *BUILD]) == 1
    assert "holds a build of 'f'" in _one_line(capsys)
    assert digests_of(built) == before


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["--grid", "99x99"], 2, "makes more tiles than"),
        (["--level", "4"], 2, "--level is 4, expected 0 to 0"),
        (["--channels", "F bodi"], 2, "did you mean 'F body'"),
        (["--spacing-um", "1,2"], 2, "--spacing-um is '1,2', expected three numbers"),
        (["--spacing-um=-1,1,1"], 2, "is -1,1,1, expected z,y,x in um, each above 0"),
        (["--spacing-um", "0,1,1"], 2, "is 0,1,1"),
        (["--iso-value", "CD31"], 2, "expected CHANNEL=VALUE"),
        (["--preset", "nobody"], 2, "expected one of ct, ct-bone, cycif"),
        (["--time", "3"], 2, "--time: found 3, expected 0 to 0"),
    ],
)
def test_wrong_flags_leave_no_file(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    code: int,
    message: str,
) -> None:
    source, out = _source(tmp_path), tmp_path / "out"
    assert main(["build", str(source), "-o", str(out), "--workers", "0", *arguments]) == code
    assert message in _one_line(capsys)
    assert not out.exists()


def test_all_zero_volume_builds_without_a_surface(tmp_path: Path) -> None:
    zeros = np.zeros((4, 24, 24), np.uint16)
    source = phantoms.write_ome_tiff(tmp_path / "zero.ome.tif", zeros)
    assert main(["build", str(source), "-o", str(tmp_path / "out"), "--workers", "0"]) == 0
    manifest = json.loads((tmp_path / "out" / "bundle" / "manifest.json").read_text("utf-8"))
    assert manifest["channels"][0]["tileset"] is None


@pytest.mark.usefixtures("undrawn")
def test_nan_outside_the_field_of_view_counts_as_the_darkest_value(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    body = phantoms.f_phantom().astype(np.float32)
    body[:, :6] = np.nan  # as at the edge of a registered stack
    body[3, 20, 5], body[4, 21, 6] = np.inf, -np.inf
    for name, voxels in (
        ("gaps", body),
        ("none", np.where(np.isfinite(body), body, body[np.isfinite(body)].min())),
    ):
        source = phantoms.write_ome_tiff(tmp_path / f"{name}.ome.tif", voxels)
        assert main(["build", str(source), "-o", str(tmp_path / name), "--workers", "0"]) == 0
        printed = " ".join(capsys.readouterr().err.split())
        assert ("of the voxels are NaN or infinite: read as the smallest" in printed) == (
            name == "gaps"
        )
    levels = [
        json.loads((tmp_path / name / "bundle" / "manifest.json").read_text("utf-8"))["channels"][
            0
        ]["level"]
        for name in ("gaps", "none")
    ]
    assert levels[0] == levels[1]
    assert levels[0] is not None


def test_plan_names_a_source_of_only_nan(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    voxels = np.full((4, 24, 24), np.nan, np.float32)
    source = phantoms.write_ome_tiff(tmp_path / "nan.ome.tif", voxels)
    assert main(["plan", str(source), "-o", str(tmp_path / "out")]) == 1
    assert "all are NaN or infinite, expected an image" in _one_line(capsys)


@pytest.mark.parametrize("phase", ["units", "stage", "bundle", "report"])
def test_phase_names_the_missing_phase_before_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], phase: str
) -> None:
    assert main([phase, str(tmp_path / "out")]) == 1
    assert "stereocell " in _one_line(capsys)
    assert not (tmp_path / "out").exists()


def test_out_that_is_a_file_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    out.write_text("in the way")
    assert main(["plan", str(_source(tmp_path)), "-o", str(out)]) == 1
    assert str(out) in _one_line(capsys)
    assert out.read_text("utf-8") == "in the way"


def test_read_only_out_is_named(
    tmp_path: Path, small_disk: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    assert main(["plan", str(_source(tmp_path)), "-o", str(small_disk / "out")]) == 1
    assert "can't be written (Read-only file system)" in _one_line(capsys)


def test_every_command_has_help_with_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    from stereocell.cli.__main__ import COMMANDS

    for name in COMMANDS:
        with pytest.raises(SystemExit) as stop:
            main([name, "--help"])
        assert stop.value.code == 0
        assert f"example: stereocell {name}" in capsys.readouterr().out


@pytest.mark.usefixtures("undrawn")
def test_fewer_channels_leave_no_stale_file_in_the_stage(built: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(built, out)
    source = str(_source(tmp_path))
    assert main(["build", source, "-o", str(out), *BUILD, "--channels", "F body"]) == 0
    # The units stay, because a later plan may need them again.
    assert list(out.rglob("empty*")) != []
    for part in ("stage", "bundle"):
        left = [f for f in (out / part).rglob("*empty*") if f.parent.name != "assets"]
        assert not left


@pytest.mark.parametrize("change", [["--grid", "1x1"], ["--iso-value", "F body=400"]])
def test_stage_of_another_plan_than_the_units_is_refused(
    built: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], change: list[str]
) -> None:
    out = tmp_path / "out"
    shutil.copytree(built, out)
    assert main(["plan", str(_source(tmp_path)), "-o", str(out), *change]) == 0
    for phase in ("stage", "report"):
        capsys.readouterr()
        assert main([phase, str(out)]) == 1
        assert f"run `stereocell units {out}`" in _one_line(capsys)


@pytest.mark.parametrize("value", ["nan", "inf"])
def test_iso_value_must_be_finite(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], value: str
) -> None:
    arguments = ["plan", str(_source(tmp_path)), "-o", str(tmp_path / "out")]
    assert main([*arguments, "--iso-value", f"F body={value}"]) == 2
    assert "expected a number" in _one_line(capsys)


def test_the_layer_in_the_docs_recolours_the_bundle(built: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(built, out)
    page = (Path(__file__).parents[2] / "docs" / "stage-layers.md").read_text("utf-8")
    layer = page.split("```usda\n")[1].split("```")[0]
    layer = layer.replace("out/mine", str(out)).replace("CD31", "F_x20_body")
    (tmp_path / "edited.usda").write_text(layer)
    edited = ["--stage", str(tmp_path / "edited.usda")]
    assert main(["bundle", str(out), "--workers", "0", *edited]) == 0
    manifest = json.loads((out / "bundle" / "manifest.json").read_text("utf-8"))
    assert manifest["channels"][0]["color"] == pytest.approx([1, 0.1, 0.1])


def test_one_finished_unit_does_not_count_as_all_units(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = _source(tmp_path), tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out), "--grid", "2x1"]) == 0
    assert main(["units", str(out), "--workers", "0", "--only", "r0_c1/F body"]) == 0
    assert len(list(out.rglob("unit.json"))) == 1
    assert not OutFolder(out).index_file.exists()
    capsys.readouterr()
    assert main(["stage", str(out)]) == 1
    assert f"run `stereocell units {out}`" in _one_line(capsys)
    assert main(["units", str(out), "--workers", "0"]) == 0
    assert main(["stage", str(out), "--workers", "0"]) == 0
