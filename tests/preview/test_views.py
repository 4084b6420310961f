"""Pictures of a patient are the right way up for every order of stored voxels."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from stereocell import read
from stereocell.model.rigid_transform import IDENTITY
from stereocell.preview.draw_slices import Slice, paint_slices
from stereocell.preview.views import MICROSCOPE, View, views_of
from support.dicom_reading import whole
from support.dicom_series import (
    BRIGHTEST,
    FEW_ORIENTATIONS,
    ORIENTATIONS,
    oriented,
    sample,
    write_series,
)
from support.exhaustive import sweep
from support.nifti_files import write

SHAPE = (22, 24, 26)
# Position of the brightest body, LPS in mm: to the left, in front of and above the middle
left, back, up = BRIGHTEST
assert left > 5
assert back < -5
assert up > 5
ITS_SIDES = set("LAS")


def require_upright(view: View, voxels: np.ndarray) -> None:
    """Assert that the brightest body lies towards the edges of the picture that name its sides."""
    seen = view.plane(voxels.max(axis=view.order[0]).transpose(_kept(view)))
    row, column = np.unravel_index(int(seen.argmax()), seen.shape)
    at_left, at_right, at_top, at_bottom = view.ends
    assert (column < seen.shape[1] / 2) == (at_left in ITS_SIDES)
    assert (column > seen.shape[1] / 2) == (at_right in ITS_SIDES)
    assert (row < seen.shape[0] / 2) == (at_top in ITS_SIDES)
    assert (row > seen.shape[0] / 2) == (at_bottom in ITS_SIDES)


def _kept(view: View) -> tuple[int, int]:
    """Return the axes of rows and of columns in a projection, which lacks the view's third axis."""
    axis, down, right = view.order
    return down - (down > axis), right - (right > axis)


@pytest.mark.parametrize(("order", "signs"), ORIENTATIONS)
def test_pictures_of_nifti_of_every_orientation_are_upright(
    tmp_path: Path, order: tuple[int, ...], signs: tuple[int, ...]
) -> None:
    affine = oriented(order, signs, SHAPE)
    voxels = np.rint(sample(affine, SHAPE)).astype(np.int16)
    dataset = read.open(write(tmp_path / "a.nii", affine, voxels))
    for is_neurological in (False, True):
        for view in views_of(dataset.placement, is_neurological=is_neurological):
            require_upright(view, whole(dataset))


@pytest.mark.parametrize(("order", "signs"), sweep(ORIENTATIONS, kept=FEW_ORIENTATIONS))
def test_pictures_of_dicom_of_every_orientation_are_upright(
    tmp_path: Path, order: tuple[int, ...], signs: tuple[int, ...]
) -> None:
    write_series(tmp_path / "s", oriented(order, signs, SHAPE), SHAPE)
    dataset = read.open(tmp_path / "s")
    for view in views_of(dataset.placement):
        require_upright(view, whole(dataset))


def test_radiologists_see_right_on_the_left_and_neurologists_on_the_right() -> None:
    placed = tuple(tuple(row) for row in (np.eye(4) + np.eye(4, k=3)).tolist())
    radiological = {view.name: view.ends for view in views_of(placed)}
    assert radiological == {
        "coronal": ("R", "L", "S", "I"),
        "axial": ("R", "L", "A", "P"),
        "sagittal": ("A", "P", "S", "I"),
    }
    neurological = {v.name: v.ends for v in views_of(placed, is_neurological=True)}
    assert neurological == {
        "coronal": ("L", "R", "S", "I"),
        "axial": ("L", "R", "A", "P"),
        "sagittal": ("A", "P", "S", "I"),
    }
    assert [view.name for view in views_of(IDENTITY)] == ["xy", "xz", "yz"]


def test_lines_are_turned_with_the_picture() -> None:
    plane = np.zeros((5, 8))
    plane[1, 6] = 1
    for view in (*MICROSCOPE, *views_of(((2.0,),))):
        row, column = np.argwhere(view.plane(plane))[0]
        assert view.points(np.array([1.0, 6.0]), plane.shape).tolist() == [row, column]


def test_letters_stand_at_the_edges_of_their_panel() -> None:
    views = views_of(((2.0,),))
    dark = np.zeros((60, 60), np.uint8)
    parts = [Slice(view, dark, (1.0, 1.0), np.zeros((0, 2, 2)), None) for view in views]
    blank = [
        Slice(View(v.name, v.order, v.flips, ("", "", "", "")), *_rest(part))
        for v, part in zip(views, parts, strict=True)
    ]
    drawn, bare = (
        np.asarray(paint_slices(some, 300).convert("L")).astype(int) for some in (parts, blank)
    )
    rows, columns = np.nonzero(drawn != bare)
    first = (rows < 300) & (columns < 300)  # the panel of the first view
    spread = {
        "left": (columns[first] < 20).sum(),
        "right": (columns[first] > 280).sum(),
        "top": (rows[first] < 20).sum(),
        "bottom": (rows[first] > 280).sum(),
    }
    assert min(spread.values()) > 5
    assert isinstance(paint_slices(parts, 300), Image.Image)


def _rest(part: Slice) -> tuple[object, ...]:
    return part.grey, part.spacing_um, part.outline, part.above
