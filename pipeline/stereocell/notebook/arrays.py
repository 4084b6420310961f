"""Turn an array into a source that a build reads: one file, small enough for a quick build.

Arrays of numpy, dask, zarr and xarray are recognised by their attributes, so that none of these
packages must be installed. A large array is reduced by averaging blocks of voxels, whose edges are
as equal in um as possible. It is read by a few planes at a time to save memory.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, isfinite, prod
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_OID, uuid5

import numpy as np
import tifffile
from numpy.typing import NDArray

from stereocell.model.errors import UsageError
from stereocell.read.spacing import um_per

Triple = tuple[float, float, float]

MAX_VOXELS = 4_000_000  # voxels of all channels; their build takes half a minute on two cores
_MAX_READ = 2**30  # voxels, largest array; a larger one takes minutes to read
_MIN_EDGE = 4  # voxels, shortest edge; a thinner array has no surface
_AXES = {3: "zyx", 4: "czyx"}
_READ_AT_ONCE = 2**24  # voxels that are read at a time


@dataclass(frozen=True, slots=True)
class ArraySource:
    """An array that a notebook shows.

    data        an array (z, y, x) or (c, z, y, x) whose slices convert to numpy arrays
    spacing_um  voxel spacing (z, y, x), um
    channels    names of the channels
    """

    data: Any
    spacing_um: Triple
    channels: tuple[str, ...]

    @property
    def shape(self) -> tuple[int, int, int, int]:
        """The array's shape as (c, z, y, x), with one channel for an array (z, y, x)."""
        shape = tuple(int(n) for n in self.data.shape)
        return (1, *shape) if len(shape) == 3 else shape  # type: ignore[return-value]

    def planes(self, channel: int, start: int, stop: int) -> NDArray[Any]:
        """Return the planes `start` to `stop` of a channel, (z, y, x)."""
        whole = self.data if len(self.data.shape) == 3 else self.data[channel]
        return np.asarray(whole[start:stop])


def is_array(source: Any) -> bool:
    """Return whether a source is an array rather than a path."""
    return hasattr(source, "shape") and hasattr(source, "dtype")


def as_source(
    array: Any, spacing_um: Sequence[float] | None, channels: Sequence[str] | None
) -> ArraySource:
    """Return an array with its spacing and channels. The arguments override the array's own.

    Raises UsageError if the array can't be a volume.
    """
    shape = tuple(array.shape)
    size = " x ".join(str(n) for n in shape)
    if len(shape) not in _AXES:
        raise UsageError(
            f"the array has {len(shape)} axes ({size}), expected (z, y, x) or (c, z, y, x)"
        )
    axes = _AXES[len(shape)]
    dims = tuple(str(dim).lower() for dim in getattr(array, "dims", ()))
    if dims and dims != tuple(axes):
        raise UsageError(
            f"the array's axes are {', '.join(dims)}, expected {', '.join(axes)}: transpose it"
        )
    if min(shape[-3:]) < _MIN_EDGE:
        raise UsageError(
            f"the array has {size} voxels, expected at least {_MIN_EDGE} along z, y and x"
        )
    if array.dtype.kind not in "buif":
        raise UsageError(
            f"the array's type is {array.dtype}, expected integers, floating-point numbers or "
            "booleans"
        )
    if prod(shape) > _MAX_READ:
        raise UsageError(
            f"the array has {prod(shape):,} voxels ({size}), expected at most {_MAX_READ:,} in a "
            "notebook: save it as OME-Zarr, run `stereocell build scan.ome.zarr -o out` and show "
            "out, or show a part of the array"
        )
    found = spacing_um if spacing_um is not None else _spacing_of(array)
    if found is None:
        raise UsageError(
            "the array states no voxel spacing, expected one: pass it as "
            "spacing_um=(0.5, 0.25, 0.25), for (z, y, x)"
        )
    spacing = check_spacing(found)
    count = shape[0] if len(shape) == 4 else 1
    names = list(channels) if channels is not None else _names_of(array, count)
    if len(names) != count or len(set(names)) != count or not all(names):
        raise UsageError(f"channels are {names!r:.80}, expected {count} different names")
    # The variable of an xarray.DataArray is used, since slicing the array would copy coordinates.
    data = getattr(array, "variable", array)
    return ArraySource(getattr(data, "data", data) if dims else data, spacing, tuple(names))


def check_spacing(given: Any) -> Triple:
    """Return a voxel spacing (z, y, x), um. Raises UsageError for any other value."""
    try:
        z, y, x = (float(v) for v in given)
    except (TypeError, ValueError):  # such as a single number, or a text
        z = y = x = 0.0
    if not all(isfinite(v) and v > 0 for v in (z, y, x)):
        raise UsageError(f"spacing_um is {given!r:.60}, expected z, y, x in um, each above 0")
    return z, y, x


def _spacing_of(array: Any) -> tuple[float, ...] | None:
    """Return the spacing of an xarray's coordinates; None unless z, y and x have coordinates.

    Raises UsageError for uneven coordinates, or a unit that is not a length.
    """
    spacing = []
    for axis in "zyx":
        coordinate = getattr(array, "coords", {}).get(axis)
        if coordinate is None:
            return None
        places = np.asarray(coordinate.data, float)
        step = float((places[-1] - places[0]) / (len(places) - 1))
        if not np.allclose(np.diff(places), step, rtol=1e-3):
            raise UsageError(
                f"the array's coordinates along {axis} are uneven, expected even ones: pass "
                "spacing_um"
            )
        unit = coordinate.attrs.get("units", "um")
        um = um_per(unit)
        if um is None:
            raise UsageError(
                f"the array's unit along {axis} is {unit!r:.40}, expected a length: pass spacing_um"
            )
        spacing.append(abs(step) * um)
    return tuple(spacing)


def _names_of(array: Any, count: int) -> list[str]:
    coordinate = getattr(array, "coords", {}).get("c")
    if coordinate is not None:
        return [str(name) for name in coordinate.data]
    name = getattr(array, "name", None)
    if count == 1:
        return [str(name) if isinstance(name, str) and name and "/" not in name else "volume"]
    return [f"channel {i + 1}" for i in range(count)]


def find_blocks(source: ArraySource, *, most: int = MAX_VOXELS) -> tuple[int, int, int]:
    """Return the block of voxels (z, y, x) that becomes one voxel, so that at most `most` are left.

    The edges of the new voxels grow step by step until few enough are left. An axis whose spacing
    is already larger is not reduced. No axis gets shorter than a surface needs.
    """
    count, *shape = source.shape
    finest = min(source.spacing_um)
    widest = [max(1, n // _MIN_EDGE) for n in shape]
    for step in range(1, max(widest) * ceil(max(source.spacing_um) / finest) + 1):
        edge = step * finest * (1 + 1e-9)
        z, y, x = (
            min(max(1, int(edge / own)), most_wide)
            for own, most_wide in zip(source.spacing_um, widest, strict=True)
        )
        left = count * prod(ceil(n / b) for n, b in zip(shape, (z, y, x), strict=True))
        if left <= most or [z, y, x] == widest:
            break
    return z, y, x


def describe_quality(source: ArraySource, blocks: tuple[int, int, int]) -> str:
    """Return a sentence on how the array was reduced, and why; empty if it was not."""
    if blocks == (1, 1, 1):
        return ""
    voxels = prod(source.shape)
    return (
        f"Shows means of {' x '.join(str(b) for b in blocks)} voxels (z, y, x): the array has "
        f"{voxels:,} voxels, and a build is quick up to {MAX_VOXELS:,}. Use quality='full' for all."
    )


def write_source(source: ArraySource, path: Path, blocks: tuple[int, int, int]) -> None:
    """Write an array as OME-TIFF; the same array gives the same bytes.

    Raises UsageError for an array without finite values.
    """
    count, depth, *_ = source.shape
    coarse = [
        np.concatenate([_mean(part, blocks) for part in _parts(source, channel, depth, blocks[0])])
        for channel in range(count)
    ]
    voxels = _as_stored(np.stack(coarse))
    spacing = [s * b for s, b in zip(source.spacing_um, blocks, strict=True)]
    content = hashlib.sha256(np.ascontiguousarray(voxels).data)
    content.update(repr((spacing, source.channels)).encode())
    metadata = {
        # tifffile would choose a random UUID
        "UUID": str(uuid5(NAMESPACE_OID, content.hexdigest())),
        "axes": "CZYX",
        "Channel": {"Name": list(source.channels)},
        **{f"PhysicalSize{axis}": edge for axis, edge in zip("ZYX", spacing, strict=True)},
        **{f"PhysicalSize{axis}Unit": "um" for axis in "ZYX"},
    }
    tifffile.imwrite(path, voxels, ome=True, metadata=metadata, photometric="minisblack")


def _parts(source: ArraySource, channel: int, depth: int, block: int) -> list[NDArray[Any]]:
    height, width = source.shape[2:]
    planes = max(1, _READ_AT_ONCE // (height * width) // block) * block
    return [source.planes(channel, z, min(z + planes, depth)) for z in range(0, depth, planes)]


def _mean(part: NDArray[Any], blocks: tuple[int, int, int]) -> NDArray[Any]:
    """Return means over blocks; the last block along an axis may have fewer voxels."""
    if blocks == (1, 1, 1):
        return part
    sums, counts = part.astype(np.float64), np.ones((1, 1, 1))
    for axis, (size, block) in enumerate(zip(part.shape, blocks, strict=True)):
        starts = np.arange(0, size, block)
        sums = np.add.reduceat(sums, starts, axis=axis)
        each = np.diff([*starts, size])
        counts = counts * each.reshape([-1 if i == axis else 1 for i in range(3)])
    mean = sums / counts
    return np.rint(mean).astype(part.dtype) if part.dtype.kind in "ui" else mean


def _as_stored(voxels: NDArray[Any]) -> NDArray[Any]:
    """Convert voxels to a type that OME-TIFF can store and a build can read.

    Raises UsageError if no value is finite.
    """
    if voxels.dtype.kind == "b":
        return voxels.astype(np.uint8)
    if voxels.dtype.kind == "f":
        if not np.isfinite(voxels).any():
            raise UsageError("the array has no finite value")
        return voxels.astype(np.float32)
    low, high = int(voxels.min()), int(voxels.max())
    for kind in (voxels.dtype, np.uint16, np.int16):
        limits = np.iinfo(kind)
        if limits.bits <= 16 and limits.min <= low and high <= limits.max:
            return voxels.astype(np.dtype(kind).newbyteorder("="))
    return voxels.astype(np.float32)
