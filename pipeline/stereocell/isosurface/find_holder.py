"""Find what a CT scanner holds a body with: its table, a head holder, straps; to be left out.

At the level of skin such a piece is a solid like the body, and often touches it. But it is a sheet
or a bar: thinner than the body, long, and joined to it by a small part of its surface. So the body
is what lies near its own cores, voxels deep inside; what is left is apart where it is long and
hardly joined. An ear or a nose is short, a face that the volume's end cuts is joined by its cut.

Some bodies are sheets themselves: a dry skull, a shell with something thick in it, an animal's
ears and tail. So a holder is smaller than what it holds, comes in through the volume's end, is not
within the body, and is no bone. A table may be as dense as bone and larger than the ribs. But the
bones of a soft body lie in flesh, and a table lies in air. Lungs count as a part of the body that
is round them: the wall of a chest alone would be a sheet, too.
"""

from typing import Any

import cc3d
import edt
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.holder import Holder
from stereocell.isosurface.holder_pieces import (
    BONE_HU,
    comes_in,
    complete,
    dense_share,
    is_within,
    joined_share,
    kind_of,
    places_of,
    sizes_in_words,
)
from stereocell.model.spacing import Spacing
from stereocell.model.tiling import Box

SKIN_HU = -300.0
MIN_HU = -500.0  # darkest voxel, at most: else the values are no Hounsfield units
_DEPTH_UM, _DEPTH_SHARE = 12_000.0, 0.1  # depth of a core; at most this share of the body's side
_CORE_SHARE = 0.02  # least share of the largest core's voxels: arms and legs have own cores
_SLACK = 1.5  # coarsest spacings that the body reaches beyond a core's depth
_LENGTH = 8.0  # depths: diagonal of the box of a piece that is apart, at least
# A piece with a larger share of the body's voxels than its kind allows belongs to the body (a dry
# skull round something soft is larger than it), and so does one with a larger share of its surface
# joined to the body or to the volume's end.
_LIMITS: dict[str, tuple[float, float]] = {
    "plain": (0.5, 0.18),
    "bone": (0.5, 0.18),
    "table": (1.0, 0.5),
    "metal": (1.0, 0.5),
}
_MAX_DENSE_SHARE = 0.5  # share of a body's voxels as dense as bone: one with more of them is bone
_LUNG_HU = -960.0  # mean of a hollow from which on it is lung; air has -1000
_ENCLOSED = 0.3  # share of a lung's surface that lies at the body as it is found without lungs
_CELLS = 1 << 22  # most cells of the mask that is kept


def find_holder(voxels: NDArray[Any], spacing_um: Spacing, region: Box) -> Holder | None:
    """Return what is to be left out of a CT; None: nothing is.

    voxels      (z, y, x), Hounsfield units; they cover `region` at any resolution
    spacing_um  (z, y, x), of these voxels
    region      voxels of the level that is built
    """
    solid = voxels > SKIN_HU
    if float(voxels.min()) > MIN_HU or not solid.any():
        return None
    spacing = np.asarray(spacing_um)
    (box,) = ndimage.find_objects(solid.astype(np.uint8))
    side = min((s.stop - s.start) * step for s, step in zip(box, spacing, strict=True))
    depth = min(_DEPTH_UM, _DEPTH_SHARE * side)
    body = _body(voxels, solid, spacing, depth)
    if body is None:
        return None
    found, pieces = _pieces_outside(voxels, solid, body, spacing, depth)
    if not pieces:
        return None
    # as far as it is blurred, and not into what stays
    kept = solid & ~found
    wide = ndimage.binary_dilation(found, iterations=2) & ~ndimage.binary_dilation(kept)
    return Holder(region, _cells_of(wide | found, kept), sizes_in_words(pieces))


def _pieces_outside(
    voxels: NDArray[Any],
    solid: NDArray[np.bool_],
    body: NDArray[np.bool_],
    spacing: NDArray[np.float64],
    depth: float,
) -> tuple[NDArray[np.bool_], list[NDArray[np.float64]]]:
    """Return where the pieces lie that are no part of the body, and each one's size, um.

    body  what lies near its own cores; pieces that belong to it are added
    """
    labels = cc3d.connected_components(solid & ~body, connectivity=26)
    is_soft = dense_share(voxels, body) <= _MAX_DENSE_SHARE
    found, sizes = np.zeros(voxels.shape, bool), []
    waiting: list[tuple[int, tuple[slice, ...], NDArray[np.float64], float]] = []
    for number, near, ends in places_of(labels):
        size = (ends[:, 1] - ends[:, 0] + 1) * spacing
        is_long = np.linalg.norm(size) >= _LENGTH * depth and comes_in(ends, voxels.shape)
        piece = labels[near] == number
        # a small piece may be metal, and nothing else that is looked for
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
        if is_within(labels == number, body):
            continue
        found[near] |= piece
        sizes.append(size)
    if sizes:
        depth_voxels = depth**3 / float(np.prod(spacing))
        found = complete(found, voxels, labels, body, depth_voxels=depth_voxels)
    return found, sizes


def _body(
    voxels: NDArray[Any],
    solid: NDArray[np.bool_],
    spacing: NDArray[np.float64],
    depth: float,
) -> NDArray[np.bool_] | None:
    """Return what lies near the cores; None: nothing is so thick.

    A core is a place deep inside. Where there are soft ones, a dense one beside them is a solid
    table: bones are not so thick, and lie in flesh.
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
    """Return the hollows that the body encloses in the slices across an axis, and that hold more
    than air. The foam of a table is enclosed by its shell alone.
    """
    hollow = np.zeros(solid.shape, bool)
    for axis in range(3):
        for closed, slice_ in zip(*(np.moveaxis(a, axis, 0) for a in (hollow, solid)), strict=True):
            labels = cc3d.connected_components(~slice_, connectivity=4)
            rim = [labels[0], labels[-1], labels[:, 0], labels[:, -1]]
            inner = np.ones(int(labels.max()) + 1, bool)
            inner[np.concatenate(rim)] = inner[0] = False
            closed |= inner[labels]
    labels = cc3d.connected_components(hollow, connectivity=6)
    counts = np.bincount(labels.ravel())
    means = np.bincount(labels.ravel(), weights=voxels.ravel()) / np.maximum(counts, 1)
    # faces of hollow voxels by the number of the hollow: those at the body, and at anything solid
    at_body, at_solid = np.zeros((2, len(counts)))
    for axis in range(3):
        moved = [np.moveaxis(a, axis, 0) for a in (labels, body, solid)]
        for here, there in ((slice(1, None), slice(None, -1)), (slice(None, -1), slice(1, None))):
            inside, near_body, near_solid = moved[0][here], moved[1][there], moved[2][there]
            at_body += np.bincount(inside[near_body], minlength=len(counts))
            at_solid += np.bincount(inside[near_solid], minlength=len(counts))
    is_lung = (means > _LUNG_HU) & (at_body >= _ENCLOSED * at_solid) & (at_solid > 0)
    is_lung[0] = False
    return np.asarray(is_lung[labels])


def _near_cores(
    voxels: NDArray[Any],
    solid: NDArray[np.bool_],
    spacing: NDArray[np.float64],
    depth: float,
) -> NDArray[np.bool_] | None:
    """Return what lies near the cores of a solid; None: nothing is so thick."""
    inside = edt.edt(solid, anisotropy=tuple(spacing), black_border=False)
    deep = inside > depth
    if 0 < dense_share(voxels, deep) <= _MAX_DENSE_SHARE:
        deep &= voxels <= BONE_HU
    cores = cc3d.connected_components(deep, connectivity=26)
    sizes = np.bincount(cores.ravel())
    sizes[0] = 0
    if not sizes.any():
        return None
    core = (sizes >= _CORE_SHARE * sizes.max())[cores] & (cores > 0)
    away = edt.edt(~core, anisotropy=tuple(spacing), black_border=False)
    near = cc3d.connected_components(
        solid & (away <= depth + _SLACK * spacing.max()), connectivity=26
    )
    holds = np.zeros(int(near.max()) + 1, bool)
    holds[np.unique(near[core])] = True  # what is near and not joined is none of it
    holds[0] = False
    return np.asarray(holds[near])


def _cells_of(mask: NDArray[np.bool_], kept: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the mask in fewer cells; one that holds a part of what stays is left in."""
    factor = 1
    while np.prod([-(-n // factor) for n in mask.shape]) > _CELLS:
        factor += 1
    if factor == 1:
        return mask
    ends = [(-(-n // factor), n) for n in mask.shape]
    index = [np.arange(n) * cells // n for cells, n in ends]
    held, holds_kept = np.zeros((2, *(cells for cells, _ in ends)), bool)
    for place, target in ((mask, held), (kept, holds_kept)):
        np.logical_or.at(
            target, tuple(index[k][one] for k, one in enumerate(place.nonzero())), True
        )
    return held & ~holds_kept
