"""Judge the pieces of a CT scan that lie apart from the body: a table, a bone, a cable, an ear."""

from collections.abc import Iterator
from typing import Any, Literal

import cc3d
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.filters.boxes import dilate, grow

BONE_HU = 500.0
_BONE_SHARE = 0.1  # largest share of a soft holder's voxels above BONE_HU; five holders had .02
# HU from which a voxel is metal, as in a cardiogram's cables and electrodes (3000). In the body
# only enamel is as dense.
_METAL_HU = 2200.0
_RING = (2, 3)  # voxels: inner and outer distance of the ring around dense voxels that is examined
_IN_AIR = 0.35  # share of that ring that is solid; dense voxels with a smaller share lie in air
# A piece lies within the body if most of its voxels have body on at least so many of six sides
_MIN_DIRECTIONS = 4
_FOAM_HU = -700.0  # darkest foam or cloth that continues a holder
_NO_FLESH_HU = -120.0  # a piece with 95 % of its voxels below holds no flesh, not even fat
# Volumes in cubed depths of a core. A piece smaller than _CRUMB is removed with the holder that it
# touches, and so is metal smaller than _CLIP at the skin.
_CRUMB, _CLIP = 0.1, 1.0
_SHOWN = 3  # largest number of pieces whose sizes are listed

Kind = Literal["plain", "bone", "table", "metal"]


def dense_share(voxels: NDArray[Any], within: NDArray[np.bool_]) -> float:
    """Return the share of the voxels of a mask that are as dense as bone."""
    return float(np.mean(voxels[within] > BONE_HU)) if within.any() else 0.0


def places_of(
    labels: NDArray[Any],
) -> Iterator[tuple[int, tuple[slice, ...], NDArray[np.int64]]]:
    """Yield each piece's number, the box around it with a margin, and its ends; largest first."""
    measures = cc3d.statistics(labels, no_slice_conversion=True)
    counts = np.asarray(measures["voxel_counts"], np.int64)
    boxes = np.asarray(measures["bounding_boxes"], np.int64).reshape(-1, 3, 2)
    margin = _RING[1]
    for number in np.argsort(-counts[1:], kind="stable") + 1:
        near = tuple(
            slice(max(int(a) - margin, 0), min(int(b) + margin + 1, n))
            for (a, b), n in zip(boxes[number], labels.shape, strict=True)
        )
        yield int(number), near, boxes[number]


def kind_of(
    voxels: NDArray[Any], piece: NDArray[np.bool_], solid: NDArray[np.bool_], *, is_soft: bool
) -> Kind:
    """Return the kind of a piece: soft, bone (or holding bone), or dense and lying in air.

    is_soft  whether the body is of flesh; then a dense piece in air is not one of its bones
    """
    if dense_share(voxels, piece) <= _BONE_SHARE:
        return "plain"
    if not is_soft:
        return "bone"
    dense = piece & (voxels > BONE_HU)
    first, last = (grow(dense, n) for n in _RING)
    ring = last & ~first
    if not ring.any() or float(np.mean(solid[ring])) > _IN_AIR:
        return "bone"
    return "metal" if float(voxels[piece].max()) > _METAL_HU else "table"


def reaches_end(ends: NDArray[np.int64], shape: tuple[int, ...]) -> bool:
    """Return whether a piece reaches the volume's end."""
    return bool((ends[:, 0] == 0).any() or (ends[:, 1] == np.array(shape) - 1).any())


def is_within(piece: NDArray[np.bool_], near: tuple[slice, ...], body: NDArray[np.bool_]) -> bool:
    """Return whether most of a piece has the body on most sides.

    piece  bool (z, y, x), in a box of the volume
    near   place of that box
    body   bool (z, y, x), the whole volume
    """
    sides = np.zeros(np.count_nonzero(piece), np.uint8)
    for axis in range(3):
        # The lines of voxels along the axis that meet the box, from end to end
        lines = body[tuple(slice(None) if k == axis else near[k] for k in range(3))]
        within = tuple(near[k] if k == axis else slice(None) for k in range(3))
        for way in (slice(None), slice(None, None, -1)):
            along = tuple(way if k == axis else slice(None) for k in range(3))
            passed = np.logical_or.accumulate(lines[along], axis=axis)[along]
            sides += passed[within][piece]
    return bool(np.mean(sides >= _MIN_DIRECTIONS) > 0.5)


def joined_share(
    piece: NDArray[np.bool_],
    body: NDArray[np.bool_],
    solid: NDArray[np.bool_],
    spacing: NDArray[np.float64],
) -> float:
    """Return the share of a piece's surface that lies at the body or at the volume's end."""
    joined = free = 0.0
    for axis in range(3):
        area = float(np.prod(spacing) / spacing[axis])
        along, others, air = (np.moveaxis(one, axis, 0) for one in (piece, body, ~solid))
        for here, there in ((slice(1, None), slice(None, -1)), (slice(None, -1), slice(1, None))):
            joined += area * np.count_nonzero(along[here] & others[there])
            free += area * np.count_nonzero(along[here] & air[there])
        # The cut-out has no margin where the volume ends.
        joined += area * (np.count_nonzero(along[0]) + np.count_nonzero(along[-1]))
    return joined / (joined + free) if joined + free else 1.0


def add_attached(
    found: NDArray[np.bool_],
    voxels: NDArray[Any],
    labels: NDArray[Any],
    body: NDArray[np.bool_],
    *,
    depth_voxels: float,
) -> NDArray[np.bool_]:
    """Return a holder with everything attached to it, so that no half of it stays.

    A pad is as faint as the level of skin, which cuts it into pieces. Voxels that are fainter still
    connect them. Pieces without flesh and small crumbs are removed with the holder. An ear in a
    head rest stays.

    found         voxels of the holder
    voxels        (z, y, x), Hounsfield units
    labels        pieces apart from the body, by number
    body          the body; metal at its skin that touches the holder is removed from it, in place
    depth_voxels  a core's depth cubed, in voxels
    """
    counts = np.bincount(labels.ravel())
    stays = np.zeros(len(counts), bool)
    for number, place in enumerate(ndimage.find_objects(labels), start=1):
        values = voxels[place][labels[place] == number]
        has_flesh = float(np.percentile(values, 95)) > _NO_FLESH_HU
        stays[number] = has_flesh and counts[number] > _CRUMB * depth_voxels
    blocked = dilate(body, (1, 1, 1)) | stays[labels]
    faint = cc3d.connected_components(found | ((voxels > _FOAM_HU) & ~blocked), connectivity=26)
    is_attached = np.zeros(int(faint.max()) + 1, bool)
    is_attached[np.unique(faint[found])] = True
    whole = np.asarray(is_attached[faint])
    clips = _clips(whole, voxels, body, depth_voxels)
    body &= ~clips
    return whole | clips


def _clips(
    found: NDArray[np.bool_], voxels: NDArray[Any], body: NDArray[np.bool_], depth_voxels: float
) -> NDArray[np.bool_]:
    """Return small pieces of metal at the skin, such as electrodes, that touch left-out pieces."""
    dense = cc3d.connected_components(body & (voxels > BONE_HU), connectivity=26)
    touched = np.unique(dense[grow(found, 2)])
    is_clip = np.zeros(int(dense.max()) + 1, bool)
    for number in touched[touched > 0]:
        piece = dense == number
        is_small = np.count_nonzero(piece) <= _CLIP * depth_voxels
        is_clip[number] = is_small and float(voxels[piece].max()) > _METAL_HU
    return np.asarray(is_clip[dense])


def sizes_in_words(sizes: list[NDArray[np.float64]]) -> tuple[str, ...]:
    """Return the sizes (z, y, x) of pieces as text in mm, largest first. sizes: um."""
    largest = sorted(sizes, key=lambda size: (-float(np.prod(size)), *size))
    words = [
        " x ".join(f"{length / 1000:.0f}" for length in size) + " mm (z, y, x)"
        for size in largest[:_SHOWN]
    ]
    more = len(largest) - _SHOWN
    return (*words, f"and {more} smaller") if more > 0 else tuple(words)
