"""Builds from DICOM and NIfTI: in every file, bodies lie at their place in the world."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import zstandard
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom

from stereocell.cli.__main__ import main
from stereocell.planning.channels import MR_GREY, SKIN
from stereocell.verify.formats import check
from support.bundles import load
from support.dicom_series import BODIES, BRIGHTEST, grid, sample, turn, write_enhanced, write_series
from support.glbs import decoded_positions_m
from support.nifti_files import write as write_nifti

SHAPE = (24, 40, 36)
OBLIQUE = turn((1, 2, -0.5), 23.0)
AIR = -1024
LEVEL = 720  # above the other bodies' heights, so only a ball of the brightest body remains
RADIUS_UM = 1000 * BODIES[0][1] * np.sqrt(2 * np.log(BODIES[0][2] / LEVEL))
# world = (L, S, -P)
CENTRE_UM = 1000 * np.array([BRIGHTEST[0], BRIGHTEST[2], -BRIGHTEST[1]])


def dicom(folder: Path) -> Path:
    affine = grid("sagittal", SHAPE, (1.5, 1.2, 1.2), OBLIQUE, shift=(6, -10, 4))
    # As scanners store values: 12 bits without a sign, and air at -1024.
    write_series(folder, affine, SHAPE, modality="CT", dtype=np.uint16, bits=12, intercept=AIR)
    return folder


def nifti(folder: Path) -> Path:
    affine = grid("axial", SHAPE, (1.5, 1.2, 1.2), OBLIQUE, shift=(6, -10, 4))
    folder.mkdir()
    return write_nifti(folder / "a.nii.gz", affine, np.rint(sample(affine, SHAPE)).astype(np.int16))


@pytest.fixture(scope="module", params=[dicom, nifti], ids=["DICOM", "NIfTI"])
def built(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    make: Callable[[Path], Path] = request.param
    folder = tmp_path_factory.mktemp("build")
    source, out = make(folder / "source"), folder / "out"
    level = f"CT={LEVEL + AIR}" if make is dicom else f"NIfTI={LEVEL}"
    config = folder / "mine.toml"
    config.write_text('[plan]\nmodality = "PT"\n')  # NIfTI states no modality
    given = [str(source), "-o", str(out), "--iso-value", level, "--grid", "2x1"]
    given += ["--config", str(config)]
    assert main(["plan", *given]) == 0
    for phase in ("units", "stage", "bundle"):
        assert main([phase, str(out), "--workers", "0"]) == 0
    return out


def is_the_ball(points_um: NDArray[np.float64]) -> bool:
    """Return whether points lie on the ball, within half a voxel and the effect of smoothing."""
    away = np.linalg.norm(points_um - CENTRE_UM, axis=1)
    middle = (points_um.min(axis=0) + points_um.max(axis=0)) / 2
    return bool(np.abs(away - RADIUS_UM).max() < 1000 and np.linalg.norm(middle - CENTRE_UM) < 400)


def test_the_stage_has_the_ball_at_its_place(built: Path) -> None:
    stage = Usd.Stage.Open(str(built / "stage" / "stage.usda"))
    parts = []
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh) and prim.GetAttribute("points").Get():
            move = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim))
            local = np.array(prim.GetAttribute("points").Get(), np.float64)
            parts.append(local @ move[:3, :3] + move[3, :3])
    assert is_the_ball(np.concatenate(parts))
    operations = UsdGeom.Xformable(stage.GetPrimAtPath("/Specimen/Tiles")).GetOrderedXformOps()
    assert [str(op.GetOpName()) for op in operations] == ["xformOp:transform"]


def test_extents_of_the_stage_contain_its_content(built: Path) -> None:
    stage = Usd.Stage.Open(str(built / "stage" / "stage.usda"))
    purposes = [UsdGeom.Tokens.default_]
    drawn = UsdGeom.BBoxCache(Usd.TimeCode.Default(), purposes, useExtentsHint=False)
    hinted = UsdGeom.BBoxCache(Usd.TimeCode.Default(), purposes, useExtentsHint=True)
    tiles = stage.GetPrimAtPath("/Specimen/Tiles")
    inner = drawn.ComputeWorldBound(tiles).ComputeAlignedRange()
    outer = hinted.ComputeWorldBound(tiles).ComputeAlignedRange()
    assert outer.Contains(inner)
    camera = stage.GetPrimAtPath("/Specimen/Cameras/mono")
    eye = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(camera))[3, :3]
    surfaces = Gf.Range3d()
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            surfaces.UnionWith(drawn.ComputeWorldBound(prim).ComputeAlignedRange())
    assert eye[:2] == pytest.approx(np.array(surfaces.GetMidpoint())[:2], abs=3000)
    assert eye[2] > outer.GetMax()[2]


def test_the_bundle_s_surfaces_are_the_ball_within_their_boxes(built: Path) -> None:
    bundle = built / "bundle"
    files = sorted((bundle / "channels").rglob("lod0.glb"))
    points = np.concatenate([decoded_positions_m(file.read_bytes()) for file in files]) * 1e6
    assert is_the_ball(points.astype(np.float64))
    bounds = load(bundle / "manifest.json")["specimen"]["bounds_um"]
    assert (points > bounds["min"]).all()
    assert (points < bounds["max"]).all()


def test_the_bundle_s_volumes_have_the_bright_body_at_its_place(built: Path) -> None:
    bundle = built / "bundle"
    (listing,) = (bundle / "channels").rglob("volumes.json")
    total, moment = 0.0, np.zeros(3)
    for entry in load(listing)["volumes"]:
        data = (bundle / entry["file"]["path"]).read_bytes()
        level = entry["levels"][0]
        frame = data[level["offset"] : level["offset"] + level["length"]]
        size = np.array(entry["size"])
        texels = np.frombuffer(zstandard.decompress(frame), np.uint8).reshape(size[::-1])
        inside = texels[1:-1, 1:-1, 1:-1]
        # Texture x, y, z to shares of the box; y runs down, see schemas/volumes.schema.json.
        z, y, x = np.nonzero(inside > 255 * LEVEL / 1000)
        share = np.stack([x, inside.shape[1] - 1 - y, z], axis=-1) / (size - 3)
        low, high = (np.array(entry["bounds_um"][end]) for end in ("min", "max"))
        matrix = np.array(entry["matrix"]).reshape(4, 4).T  # the stored matrix is column-major
        places = (low + share * (high - low)) @ matrix[:3, :3].T + matrix[:3, 3]
        total += len(places)
        moment += places.sum(axis=0)
    assert total > 100
    # The tiles share a plane of voxels, which counts twice.
    assert np.linalg.norm(moment / total - CENTRE_UM) < 600


def test_the_manifest_knows_the_modality_and_check_finds_nothing(built: Path) -> None:
    specimen = load(built / "bundle" / "manifest.json")["specimen"]
    is_dicom = load(built / "plan.json")["name"] == "CT"
    assert specimen["modality"] == ("CT" if is_dicom else "PT")
    stage = Usd.Stage.Open(str(built / "stage" / "stage.usda"))
    root = stage.GetDefaultPrim()
    assert root.HasAPI("StereoCellSpecimenAPI")
    assert root.GetAttribute("stereocell:modality").Get() == specimen["modality"]
    assert [line for line in check(built) if not line.ok] == []


@pytest.mark.parametrize(("write", "modality"), [(nifti, "MR"), (dicom, "CT")])
def test_modality_of_the_preset_holds_if_the_input_states_none(
    write: Callable[[Path], Path], modality: str, tmp_path: Path
) -> None:
    source = write(tmp_path / "s")
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), "--preset", "mri"]) == 0
    plan = json.loads((tmp_path / "out" / "plan.json").read_text("utf-8"))
    assert plan["modality"] == modality
    assert plan["channels"][0]["color"] == list(SKIN if modality == "CT" else MR_GREY)


def test_series_are_listed_and_chosen_by_number(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small = (6, 30, 26)
    write_series(tmp_path / "s" / "a", grid(shape=small), small, modality="CT", intercept=AIR)
    write_enhanced(tmp_path / "s" / "b", grid("coronal"), (22, 30, 26))
    out = tmp_path / "out"
    for command in ("build", "plan", "slices"):
        assert main([command, str(tmp_path / "s"), "-o", str(out), "--series", "list"]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert [line.split()[:3] for line in lines[:2]] == [
            ["1", "MR,", "coronal,"],
            ["2", "CT,", "axial,"],
        ]
        assert [line.split(":")[0] for line in lines[2:]] == ["order"]
    assert not out.exists()
    given = [str(tmp_path / "s"), "-o", str(out), "--preset", "mri"]
    assert main(["plan", *given, "--series", "2"]) == 0
    assert load(out / "plan.json")["modality"] == "CT"
    assert main(["plan", *given]) == 1
    assert "'CT' with --series 2, not 0" in capsys.readouterr().err
    assert main(["plan", *given, "--series", "x"]) == 2
    assert "--series is 'x', expected a number from 1, or `list`" in capsys.readouterr().err
