"""Find the equipment that holds a body in a CT scan (table, head holder, straps) to leave it out.

At the level of skin such a piece is a solid like the body, and often touches it. But it is a sheet
or a bar: thinner than the body, long, and joined to it by a small part of its surface. So the body
is the part near its own cores, which are voxels deep inside. Any other piece is equipment if it is
long and hardly joined to the body. An ear or a nose is short. A face that the volume's end cuts is
joined to that end by its cut.

Some bodies are sheets themselves: a dry skull, a shell with something thick in it, an animal's ears
and tail. So a holder must also be smaller than the body, reach the volume's end, lie outside of the
body, and not be bone. A table may be as dense as bone and larger than the ribs, but the bones of a
soft body lie in flesh, and a table lies in air. Lungs count as a part of the body around them,
because the wall of a chest alone would be a sheet, too.
"""

from typing import Any

import cc3d
import numpy as np
from numpy.typing import NDArray

from stereocell.filters.boxes import grow
from stereocell.isosurface.holder import Holder
from stereocell.isosurface.holder_pieces import (
    BONE_HU,
    add_attached,
    dense_share,
    is_within,
    joined_share,
    kind_of,
    places_of,
    reaches_end,
    sizes_in_words,
)
from stereocell.kernels.hollows import count_faces, find_hollows
from stereocell.kernels.plane_distances import find_far
from stereocell.model.spacing import Spacing
from stereocell.model.tiling import Box

SKIN_HU = -300.0
# The darkest voxel of a CT is at most this; otherwise values are not Hounsfield units
MIN_HU = -500.0
# Depth of a core in um, and its largest share of the body's shortest side
_DEPTH_UM, _DEPTH_SHARE = 12_000.0, 0.1
# Least share of the largest core's voxels that another core has: arms and legs have their own cores
_CORE_SHARE = 0.02
_SLACK = 1.5  # coarsest spacings by which the body reaches beyond a core's depth
_LENGTH = 8.0  # depths of a core: least diagonal of a holder's box
# Largest share of the body's voxels, and largest share of the surface that is joined to the body or
# to the volume's end, for each kind of piece. A piece above either limit belongs to the body: a dry
# skull around something soft is larger than it.
_LIMITS: dict[str, tuple[float, float]] = {
    "plain": (0.5, 0.18),
    "bone": (0.5, 0.18),
    "table": (1.0, 0.5),
    "metal": (1.0, 0.5),
}
_MAX_DENSE_SHARE = 0.5  # share of a body's voxels as dense as bone; a body with more is bone itself
_LUNG_HU = -960.0  # least mean of a hollow that is lung; air has -1000
_ENCLOSED = 0.3  # least share of a lung's surface that lies at the body found without lungs
_CELLS = 1 << 22  # largest number of cells of the stored mask


def find_holder(voxels: NDArray[Any], spacing_um: Spacing, region: Box) -> Holder | None:
    """Return the pieces of a CT scan that are left out; None if there are none.

    voxels      (z, y, x), Hounsfield units, covering `region` at any resolution
    spacing_um  (z, y, x), of `voxels`
    region      voxels of the level that is built
    """
    solid = voxels > SKIN_HU
    if float(voxels.min()) > MIN_HU or not solid.any():
        return None
    spacing = np.asarray(spacing_um)
    box = _box_of(solid)
    side = min((s.stop - s.start) * step for s, step in zip(box, spacing, strict=True))
    depth = min(_DEPTH_UM, _DEPTH_SHARE * side)
    # The air around the solid changes nothing, beyond one layer of it.
    near = tuple(slice(max(s.start - 1, 0), s.stop + 1) for s in box)
    found_near = _body(voxels[near], np.ascontiguousarray(solid[near]), spacing, depth)
    if found_near is None:
        return None
    body = np.zeros(voxels.shape, bool)
    body[near] = found_near
    found, pieces = _pieces_outside(voxels, solid, body, spacing, depth)
    if not pieces:
        return None
    # The blurred rim is left out too, but not where it belongs to what stays.
    kept = solid & ~found
    wide = grow(found, 2) & ~grow(kept, 1)
    return Holder(region, _cells_of(wide | found, kept), sizes_in_words(pieces))


def _box_of(flags: NDArray[np.bool_]) -> list[slice]:
    """Return the box around the flags that are set, of which there is at least one."""
    ends = (np.flatnonzero(flags.any(axis=tuple({0, 1, 2} - {axis})))[[0, -1]] for axis in range(3))
    return [slice(int(first), int(last) + 1) for first, last in ends]


def _pieces_outside(
    voxels: NDArray[Any],
    solid: NDArray[np.bool_],
    body: NDArray[np.bool_],
    spacing: NDArray[np.float64],
    depth: float,
) -> tuple[NDArray[np.bool_], list[NDArray[np.float64]]]:
    """Return where the pieces outside of the body lie, and the size of each, um.

    body  the part near its own cores; pieces that turn out to belong to it are added in place
    """
    labels = cc3d.connected_components(solid & ~body, connectivity=26)
    is_soft = dense_share(voxels, body) <= _MAX_DENSE_SHARE
    found, sizes = np.zeros(voxels.shape, bool), []
    waiting: list[tuple[int, tuple[slice, ...], NDArray[np.float64], float]] = []
    for number, near, ends in places_of(labels):
        size = (ends[:, 1] - ends[:, 0] + 1) * spacing
        is_long = np.linalg.norm(size) >= _LENGTH * depth and reaches_end(ends, voxels.shape)
        piece = labels[near] == number
        # A small piece is of interest only if it may be metal.
        may_be = is_long or float(voxels[near][piece].max()) > BONE_HU
        kind = kind_of(voxels[near], piece, solid[near], is_soft=is_soft) if may_be else "plain"
        most, most_joined = _LIMITS[kind]
        if np.count_nonzero(piece) > most * np.count_nonzero(body):
            body[near] |= piece
        elif kind == "metal" or (is_long and kind != "bone"):
            waiting.append((number, near, size, most_joined))
    for number, near, size, most_joined in waiting:
        piece = labels[near] == number
        if joined_share(piece, body[near], solid[near], spacing) > most_joined:
            continue
        if is_within(piece, near, body):
            continue
        found[near] |= piece
        sizes.append(size)
    if sizes:
        depth_voxels = depth**3 / float(np.prod(spacing))
        found = add_attached(found, voxels, labels, body, depth_voxels=depth_voxels)
    return found, sizes


def _body(
    voxels: NDArray[Any],
    solid: NDArray[np.bool_],
    spacing: NDArray[np.float64],
    depth: float,
) -> NDArray[np.bool_] | None:
    """Return the part of the solid near its cores; None if nothing is thick enough.

    A core is a place deep inside. A dense core beside soft ones is a solid table, because bones are
    thinner and lie in flesh.
    """
    found = _near_cores(voxels, solid, spacing, depth)
    if found is None:
        return None
    lungs = _lungs(voxels, solid, found)
    if not lungs.any():
        return found
    filled = _near_cores(voxels, solid | lungs, spacing, depth)
    return found if filled is None else found | (filled & solid)


def _lungs(
    voxels: NDArray[Any], solid: NDArray[np.bool_], body: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return the hollows that the body encloses within slices, and that hold more than air.

    The foam of a table does not count, because only the table's own shell encloses it.
    """
    hollow = find_hollows(np.ascontiguousarray(solid))
    found, count = cc3d.connected_components(hollow, connectivity=6, return_N=True)
    labels = found.astype(np.uint32)
    if not count:
        return hollow
    own = labels[hollow]
    sums = np.bincount(own, weights=voxels[hollow], minlength=count + 1)
    means = sums / np.maximum(np.bincount(own, minlength=count + 1), 1)
    at_body, at_solid = count_faces(labels, body, np.ascontiguousarray(solid), count + 1)
    is_lung = (means > _LUNG_HU) & (at_body >= _ENCLOSED * at_solid) & (at_solid > 0)
    is_lung[0] = False
    return np.asarray(is_lung[labels])


def _near_cores(
    voxels: NDArray[Any],
    solid: NDArray[np.bool_],
    spacing: NDArray[np.float64],
    depth: float,
) -> NDArray[np.bool_] | None:
    """Return the part of a solid near its cores; None if nothing is thick enough."""
    deep = find_far(~solid, spacing, depth)
    if 0 < dense_share(voxels, deep) <= _MAX_DENSE_SHARE:
        deep &= voxels <= BONE_HU
    cores = cc3d.connected_components(deep, connectivity=26)
    sizes = np.bincount(cores.ravel())
    sizes[0] = 0
    if not sizes.any():
        return None
    core = (sizes >= _CORE_SHARE * sizes.max())[cores] & (cores > 0)
    away = find_far(core, spacing, depth + _SLACK * float(spacing.max()))
    near = cc3d.connected_components(solid & ~away, connectivity=26)
    holds = np.zeros(int(near.max()) + 1, bool)
    holds[np.unique(near[core])] = True  # parts near a core that are not joined to it do not count
    holds[0] = False
    return np.asarray(holds[near])


def _cells_of(mask: NDArray[np.bool_], kept: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the mask in at most _CELLS cells of one or more voxels.

    A cell is True if it holds voxels of the mask and none of `kept`.
    """
    factor = 1
    while np.prod([-(-n // factor) for n in mask.shape]) > _CELLS:
        factor += 1
    if factor == 1:
        return mask
    held, holds_kept = mask, kept
    for axis, n in enumerate(mask.shape):
        cells = -(-n // factor)
        # Voxel k lies in cell k * cells // n, so the cells' first voxels are these.
        first = -(-np.arange(cells) * n // cells)
        held, holds_kept = (
            np.logical_or.reduceat(flags, first, axis=axis) for flags in (held, holds_kept)
        )
    return held & ~holds_kept
