"""A patient's sides from the reader to the bundle: the letters state where bodies lie."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest
from numpy.typing import NDArray
from pxr import Gf, UsdGeom

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.volume import zyx_to_xyz
from stereocell.usd.layer import TILES
from stereocell.usd.read_stage import open_stage, sides_of
from stereocell.usd.write_stage import TileExtent, write_stage
from support.bundles import load
from support.dicom_reading import whole
from support.dicom_series import (
    BRIGHTEST,
    ORIENTATIONS,
    grid,
    oriented,
    sample,
    turn,
    write_series,
)
from support.exhaustive import sweep
from support.glbs import decoded_positions_m
from support.nifti_files import write as write_nifti

SHAPE = (16, 20, 18)
LEVEL = 600  # above the other bodies' heights, so only a ball of the brightest body remains
LEFT_MM, POSTERIOR_MM, SUPERIOR_MM = BRIGHTEST
Source = Callable[..., Path]


def nifti(folder: Path, affine: NDArray[np.float64], shape: tuple[int, int, int] = SHAPE) -> Path:
    folder.mkdir(parents=True)
    return write_nifti(folder / "a.nii", affine, np.rint(sample(affine, shape)).astype(np.int16))


def dicom(folder: Path, affine: NDArray[np.float64]) -> Path:
    write_series(folder, affine, SHAPE)
    return folder


def orientations() -> list[Any]:
    """Return all 48 orientations of NIfTI and DICOM; `make test` runs three of them."""
    cases = [(source, *case) for case in ORIENTATIONS for source in (nifti, dicom)]
    kept = [
        (nifti, (0, 1, 2), (1, 1, 1)),
        (dicom, (2, 0, 1), (-1, 1, 1)),
        (nifti, (1, 2, 0), (-1, -1, -1)),
    ]
    return sweep(cases, kept)


def build(source: Path, out: Path) -> Path:
    """Build a bundle of the brightest body's surface alone; return it."""
    name = "MR" if source.is_dir() else "NIfTI"
    given = ["--preset", "none", "--iso-value", f"{name}={LEVEL}"]
    assert main(["plan", str(source), "-o", str(out), *given]) == 0
    for phase in ("units", "stage", "bundle"):
        assert main([phase, str(out), "--workers", "0"]) == 0
    return out / "bundle"


def body_mm(bundle: Path) -> dict[str, float]:
    """Return the place of the surface's middle along each of the manifest's sides, in mm."""
    (file,) = (bundle / "channels").rglob("lod0.glb")
    points = decoded_positions_m(file.read_bytes()) * 1e3
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    sides = load(bundle / "manifest.json")["specimen"]["sides"]
    return {side: float(np.dot(middle, along)) for side, along in sides.items()}


TRUTH = {"left": LEFT_MM, "posterior": POSTERIOR_MM, "superior": SUPERIOR_MM}


@pytest.mark.parametrize("write", [nifti, dicom])
@pytest.mark.parametrize(("order", "signs"), ORIENTATIONS)
def test_voxels_run_to_the_sides_that_the_reader_states(
    write: Source, order: Sequence[int], signs: Sequence[int], tmp_path: Path
) -> None:
    dataset = read.open(write(tmp_path / "s", oriented(order, signs, SHAPE)))
    assert dataset.has_sides
    voxels = whole(dataset).astype(np.float64)
    brightest = np.array(np.unravel_index(voxels.argmax(), voxels.shape))
    z, y, x = (brightest - (np.array(voxels.shape) - 1) / 2) * dataset.levels[0].spacing_um / 1e3
    # Canonical voxels run to anterior, inferior, left. The body lies in front, above, on the left.
    assert (z, y, x) == pytest.approx((-POSTERIOR_MM, -SUPERIOR_MM, LEFT_MM), abs=1.3)

    # The stage puts the body there, too, along the sides that it states.
    spacing_um = dataset.levels[0].spacing_um
    last_um = tuple((np.array(voxels.shape) - 1) * spacing_um)
    tile = TileExtent("r0_c0", (0.0, 0.0, 0.0), last_um, tuple(spacing_um))
    write_stage(
        tmp_path,
        "patient",
        appearances=[],
        tiles=[tile],
        provenance={},
        placement=dataset.placement,
        has_sides=True,
    )
    stage = open_stage(tmp_path / "stage.usda")
    moved = UsdGeom.Xformable(stage.GetPrimAtPath(TILES)).ComputeLocalToWorldTransform(0)
    at_um = moved.Transform(Gf.Vec3d(*zyx_to_xyz(brightest * spacing_um).tolist()))
    sides = sides_of(stage)
    assert sides is not None
    found = {side: float(np.dot(at_um, along)) / 1e3 for side, along in sides.items()}
    assert found == pytest.approx(TRUTH, abs=1.3)


@pytest.mark.parametrize(("write", "order", "signs"), orientations())
def test_body_on_the_left_lies_at_the_letter_l_of_the_bundle(
    write: Source, order: Sequence[int], signs: Sequence[int], tmp_path: Path
) -> None:
    source = write(tmp_path / "s", oriented(order, signs, SHAPE))
    assert body_mm(build(source, tmp_path / "out")) == pytest.approx(TRUTH, abs=0.8)


def test_the_letters_of_an_oblique_scan_turn_with_an_edit_and_are_mirrored_by_one(
    tmp_path: Path,
) -> None:
    shape = (24, 40, 36)
    affine = grid("sagittal", shape, (1.5, 1.2, 1.2), turn((1, 2, -0.5), 23.0), shift=(6, -10, 4))
    out = tmp_path / "out"
    bundle = build(nifti(tmp_path / "s", affine, shape), out)
    assert body_mm(bundle) == pytest.approx(TRUTH, abs=0.8)
    edit = tmp_path / "mirrored.usda"
    edit.write_text(
        f"""#usda 1.0
(
    subLayers = [@{out}/stage/stage.usda@]
    metersPerUnit = 1e-06
    upAxis = "Y"
)
over "Specimen"
{{
    double3 xformOp:rotateXYZ = (0, 0, 90)
    double3 xformOp:scale = (-1, 1, 1)
    uniform token[] xformOpOrder = ["xformOp:rotateXYZ", "xformOp:scale"]
}}
"""
    )
    assert main(["bundle", str(out), "--stage", str(edit), "--workers", "0"]) == 0
    sides = load(bundle / "manifest.json")["specimen"]["sides"]
    assert sides == {"left": [0, -1, 0], "posterior": [0, 0, -1], "superior": [-1, 0, 0]}
    assert body_mm(bundle) == pytest.approx(TRUTH, abs=0.8)


def _on_four_legs(ds: pydicom.Dataset) -> None:
    ds.AnatomicalOrientationType = "QUADRUPED"


def test_unknown_sides_have_no_letters(tmp_path: Path) -> None:
    affine = grid(shape=SHAPE)
    guessed = write_nifti(tmp_path / "a.nii", affine, np.ones(SHAPE, np.int16), form="neither")
    write_series(tmp_path / "animal", affine, SHAPE, change=_on_four_legs)
    for source in (guessed, tmp_path / "animal"):
        assert not read.open(source).has_sides
    bundle = build(tmp_path / "animal", tmp_path / "out")
    assert "sides" not in load(bundle / "manifest.json")["specimen"]
