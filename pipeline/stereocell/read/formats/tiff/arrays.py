"""Voxels of a TIFF's series as lazy arrays: tifffile serves strips and tiles as Zarr chunks."""

from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from tifffile import TiffPage, TiffPageSeries

from stereocell.model.errors import SourceError
from stereocell.read import zarr_ending  # noqa: F401  (it registers a function for Python's end)
from stereocell.read.array_axes import given_axes
from stereocell.read.dataset import StoredArray, VoxelArray
from stereocell.read.decoded_chunks import DecodedChunks
from stereocell.read.image import RGB_COLORS, RGB_NAMES, Color

_RGB, _PALETTE, WHITE_IS_ZERO = 2, 3, 0  # values of the TIFF tag PhotometricInterpretation


def array_of(series: TiffPageSeries, level: int) -> VoxelArray:
    """Return a level's voxels. Axes of length 1 are squeezed out: tifffile 2026.5 requires it."""
    array = zarr.open_array(series.aszarr(level=level), mode="r")
    # tifffile's store is Zarr v3 from 2026.5 on and v2 before; each names the axes differently.
    names: Any = getattr(array.metadata, "dimension_names", None)
    names = names or array.attrs["_ARRAY_DIMENSIONS"]
    return VoxelArray(
        DecodedChunks(array), tuple(str(name).lower().rstrip("0123456789") for name in names)
    )


class FirstAlong:
    """An array at index 0 of one of its axes."""

    def __init__(self, array: StoredArray, axis: int) -> None:
        self._array, self._axis = array, axis
        self.shape = self._without(array.shape)
        self.chunks = self._without(array.chunks)
        self.dtype = array.dtype

    def _without(self, values: tuple[int, ...]) -> tuple[int, ...]:
        return (*values[: self._axis], *values[self._axis + 1 :])

    def __getitem__(self, key: Any) -> NDArray[Any]:
        return np.asarray(self._array[(*key[: self._axis], 0, *key[self._axis :])])


def with_given_axes(where: str, arrays: list[VoxelArray], axes: str) -> list[VoxelArray]:
    """Return arrays whose axes are the user's letters. Raises UsageError where they don't fit.

    axes  letters of all axes, or of those longer than 1, slowest first, such as `zcyx`
    """
    renamed = given_axes(where, arrays[0].array.shape, axes)
    return [VoxelArray(level.array, renamed) for level in arrays]


def require_depth(where: str, finest: VoxelArray) -> None:
    """Raise SourceError for a flat image whose times or channels may really be slices."""
    if finest.size("z") > 1:
        return
    for axis, noun in (("t", "time points"), ("c", "channels")):
        count = finest.size(axis)
        if count > 1 and finest.axes[-1] != axis:  # the last axis holds the colours of pixels
            lengths = {a: n for a, n in zip(finest.axes, finest.array.shape, strict=True) if n > 1}
            asked = "".join("z" if a == axis else a for a in lengths)
            raise SourceError(
                f"{where}: a volume needs at least 2 planes: found 1 along z, and {count} {noun}, "
                f"expected slices: --axes {asked} reads the {noun} as slices"
            )


def samples_as_channels(
    where: str, arrays: list[VoxelArray], page: TiffPage
) -> tuple[list[VoxelArray], tuple[str | None, ...], tuple[Color | None, ...], tuple[str, ...]]:
    """Return arrays with samples (axis s) as channels, and the channels' names, colours and notes.

    page  first page, whose tags describe the samples

    Raises SourceError where the file has channels as well as samples.
    """
    count = arrays[0].size("s")
    if count < 2:
        return arrays, (), (), ()
    if arrays[0].size("c") > 1:
        raise SourceError(
            f"{where}: SamplesPerPixel: found {count} beside {arrays[0].size('c')} channels, "
            "expected channels either as planes or as samples"
        )
    renamed = []
    for level in arrays:
        axes = tuple("c" if a == "s" else "_" if a == "c" else a for a in level.axes)
        renamed.append(VoxelArray(level.array, axes))
    if page.photometric != _RGB:
        return renamed, (None,) * count, (None,) * count, ()
    notes = [f"colour pixels: read as channels {', '.join(RGB_NAMES)}"]
    if count > len(RGB_NAMES):
        notes.append("the alpha of its pixels is left out")
    return renamed, RGB_NAMES, RGB_COLORS, tuple(notes)


def notes_of(page: TiffPage) -> tuple[str, ...]:
    """Return a sentence on each way in which pixel values stand for something else."""
    if page.photometric == _PALETTE and _is_coloured(page):
        return ("the file has a palette: its numbers are read, not the palette's colours",)
    if page.photometric == WHITE_IS_ZERO:
        return ("the file states that 0 is white: read as stored, so that 0 is dark",)
    return ()


def _is_coloured(page: TiffPage) -> bool:
    """Return whether a palette is more than a ramp of one colour, which looks like intensities."""
    palette = page.colormap
    return palette is None or not bool((np.diff(palette.astype(np.int64), axis=-1) >= 0).all())
