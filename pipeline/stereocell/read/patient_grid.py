"""The canonical form of an array that an affine places in the patient (anatomical_axes.py)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError
from stereocell.model.rigid_transform import Matrix
from stereocell.model.tiling import Box
from stereocell.read.anatomical_axes import Canonical, canonical_of
from stereocell.read.dataset import StoredArray, VoxelArray
from stereocell.read.flipped_array import FlippedArray
from stereocell.read.image import Image
from stereocell.read.resample import orthogonal_grid, resample_sheared
from stereocell.read.spacing import Grid
from stereocell.read.statements import Statement, Subject, Trust, settle
from stereocell.read.whole_array import WholeArray

_ORIGIN = Subject("place of the first voxel in the patient", "mm")
_SKEW = 1e-3  # cosine between two axes; a smaller one is due to rounding
_MIN_VOLUME = 0.1  # volume spanned by the three unit axes, 0..1; below it they lie in one plane


@dataclass(frozen=True, slots=True)
class Placed:
    """Voxels on canonical axes, their grid, and their place in the patient's world."""

    array: VoxelArray
    grid: Grid
    placement: Matrix
    notes: tuple[str, ...] = ()

    def image(self, title: str, *, notes: Sequence[str] = (), has_sides: bool) -> Image:
        """Return an image without channel names. `notes` come before the notes on the grid."""
        count = self.array.size("c")
        return Image(
            arrays=(self.array,),
            grids=(self.grid,),
            names=(title,) if count == 1 else (None,) * count,
            colors=(None,) * count,
            images=1,
            title=title,
            placement=self.placement,
            has_sides=has_sides,
            notes=(*notes, *self.notes),
        )


def settle_origin(
    field: str, stated: Sequence[float] | None
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Return the centre of the first voxel, in the field's unit, and notes.

    field   header field that holds the origin
    stated  its three numbers; None: the field is absent
    """
    found = np.zeros(3) if stated is None else np.array(stated, float)[:3]
    if stated is not None and np.isfinite(found).all():
        return found, ()
    reason = f"since {field} {'holds no numbers' if stated is not None else 'is absent'}"
    notes = settle(_ORIGIN, [Statement((0.0, 0.0, 0.0), reason, Trust.ASSUMED)]).notes
    return np.where(np.isfinite(found), found, 0.0), notes


def place(
    where: str, array: StoredArray, axes: tuple[str, ...], affine: NDArray[np.float64], field: str
) -> Placed:
    """Return an array in canonical form. Flips and permutations are applied to each window read.

    axes    names of the array's axes: i, j and k are the affine's, t and c are optional
    affine  (4, 4), for column vectors: from (i, j, k, 1) to LPS in mm
    field   header field that holds the affine, for messages

    Skew axes are resampled onto an orthogonal grid; then a whole time point is read at once.
    Raises SourceError where the affine's axes don't span three dimensions.
    """
    lengths = np.linalg.norm(affine[:3, :3], axis=0)
    is_sound = np.isfinite(affine).all() and lengths.min() > 0
    if not is_sound or abs(np.linalg.det(affine[:3, :3] / lengths)) < _MIN_VOLUME:
        raise SourceError(
            f"{where}: {field}: the axes of the affine don't span three dimensions, "
            "expected three independent axes"
        )
    i, j, k = (int(array.shape[axes.index(axis)]) for axis in "ijk")
    unit = affine[:3, :3] / lengths
    if np.abs(unit.T @ unit - np.eye(3)).max() > _SKEW:
        return _resampled(where, array, axes, affine)
    canonical = canonical_of(affine, (i, j, k))
    names, flips = list(axes), [False] * len(axes)
    for name, stored, flip in zip("zyx", canonical.order, canonical.flips, strict=True):
        names[axes.index("ijk"[stored])] = name
        flips[axes.index("ijk"[stored])] = flip
    voxels = VoxelArray(FlippedArray(array, flips) if any(flips) else array, tuple(names))
    return Placed(voxels, Grid(voxels.shape, canonical.spacing_um), canonical.placement)


def _resampled(
    where: str, array: StoredArray, axes: tuple[str, ...], affine: NDArray[np.float64]
) -> Placed:
    swapped = {"i": "x", "j": "y", "k": "z"}
    stored = VoxelArray(array, tuple(swapped.get(axis, axis) for axis in axes))
    if stored.size("c") > 1:
        raise SourceError(
            f"{where}: found skew axes and {stored.size('c')} values for each voxel, expected "
            "orthogonal axes or one value"
        )
    shape, orthogonal = orthogonal_grid(stored.shape[::-1], affine)
    canonical = canonical_of(orthogonal, shape)
    z, y, x = (shape[axis] for axis in canonical.order)
    whole = WholeArray(
        (stored.size("t"), z, y, x),
        np.dtype(array.dtype).newbyteorder("="),
        lambda time: _load(stored, affine, canonical, time),
    )
    return Placed(
        VoxelArray(whole, ("t", "z", "y", "x")),
        Grid((z, y, x), canonical.spacing_um),
        canonical.placement,
        ("the affine has skew axes: resampled onto an orthogonal grid",),
    )


def _load(
    stored: VoxelArray, affine: NDArray[np.float64], canonical: Canonical, time: int
) -> NDArray[Any]:
    voxels = stored.window(time, 0, Box((0, 0, 0), stored.shape)).transpose()
    return canonical.apply(resample_sheared(voxels, affine)[0])
