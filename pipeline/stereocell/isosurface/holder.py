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

import base64
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import cc3d
import edt
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.model.spacing import Spacing
from stereocell.model.tiling import Box

SKIN_HU = -300.0
AIR_HU = -1000.0  # value of the voxels that are left out
MIN_HU = -500.0  # darkest voxel, at most: else the values are no Hounsfield units
_DEPTH_UM, _DEPTH_SHARE = 12_000.0, 0.1  # depth of a core; at most this share of the body's side
_CORE_SHARE = 0.02  # least share of the largest core's voxels: arms and legs have own cores
_SLACK = 1.5  # coarsest spacings that the body reaches beyond a core's depth
_LENGTH = 8.0  # depths: diagonal of the box of a piece that is apart, at least
# By the kind of a piece: with a larger share of the body's voxels it belongs to the body (a dry
# skull round something soft is larger than it), and so it does with a larger share of its surface
# joined to the body or to the volume's end.
_LIMITS: dict[str, tuple[float, float]] = {
    "plain": (0.5, 0.18),
    "bone": (0.5, 0.18),
    "table": (1.0, 0.5),
}
_BONE_HU, _BONE_SHARE = (
    500.0,
    0.1,
)  # HU; largest share of a soft holder's voxels above; five had .02
_RING = (2, 3)  # voxels from dense ones, between which flesh or air is looked for
_IN_AIR = 0.35  # share of that ring that is solid: dense voxels with less of it lie in air
_MAX_DENSE_SHARE = 0.5  # share of a body's voxels as dense as bone: one with more of them is bone
_LUNG_HU = -960.0  # mean of a hollow from which on it is lung; air has -1000
_ENCLOSED = 0.3  # share of a lung's surface that lies at the body as it is found without lungs
_MIN_DIRECTIONS = 4  # directions of six in which most of a piece inside the body sees the body
_CELLS = 1 << 20  # most cells of the mask that is kept


@dataclass(frozen=True, slots=True)
class Holder:
    """Pieces that are left out.

    region  voxels (z, y, x) of the level that is built
    mask    bool (z, y, x), cells that cover the region evenly: True near such a piece
    pieces  each one's size, for people
    """

    region: Box
    mask: NDArray[np.bool_]
    pieces: tuple[str, ...]

    def at(self, box: Box) -> NDArray[np.bool_]:
        """Return which voxels of a box are left out, bool (z, y, x)."""
        return np.asarray(self.mask[np.ix_(*self._cells(box))])

    def left_out_of(self, voxels: NDArray[Any], box: Box) -> NDArray[Any]:
        """Return voxels (z, y, x) of a box with air in place of what is left out, same dtype."""
        air = np.minimum(voxels, np.asarray(AIR_HU).astype(voxels.dtype))
        return np.where(self.at(box), air, voxels)

    def around(self, box: Box) -> "Holder | None":
        """Return the same if it leaves out voxels of a box, else None."""
        return self if self.at(box).any() else None

    def _cells(self, box: Box) -> list[NDArray[np.intp]]:
        """Return the cell of each voxel along each axis."""
        return [
            np.clip((np.arange(a, b) - first) * cells // (last - first), 0, cells - 1)
            for a, b, first, last, cells in zip(
                box.start,
                box.stop,
                self.region.start,
                self.region.stop,
                self.mask.shape,
                strict=True,
            )
        ]

    def to_json(self) -> dict[str, Any]:
        """Return the same as texts and numbers; the mask as bits by zlib in base64."""
        packed = zlib.compress(np.packbits(self.mask).tobytes(), 6)
        return {
            "region": [list(self.region.start), list(self.region.stop)],
            "shape": list(self.mask.shape),
            "mask": base64.b64encode(packed).decode(),
            "pieces": list(self.pieces),
        }

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> "Holder":
        """Return what `to_json` was given."""
        shape = tuple(content["shape"])
        bits = np.frombuffer(zlib.decompress(base64.b64decode(content["mask"])), np.uint8)
        count = int(np.prod(shape, dtype=np.int64))
        start, stop = (tuple(end) for end in content["region"])
        mask = np.unpackbits(bits, count=count).reshape(shape).astype(bool)
        return cls(Box(start, stop), mask, tuple(content["pieces"]))

    @classmethod
    def __get_pydantic_core_schema__(cls, *_: Any) -> Any:
        """Let pydantic read and write it as `from_json` and `to_json` do."""
        from pydantic_core import core_schema

        return core_schema.no_info_plain_validator_function(
            lambda value: value if isinstance(value, cls) else cls.from_json(value),
            serialization=core_schema.plain_serializer_function_ser_schema(cls.to_json),
        )


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
    # as far as it is blurred, and not into the body
    wide = ndimage.binary_dilation(found, iterations=2) & ~ndimage.binary_dilation(body)
    return Holder(region, _cells_of(wide | found, body), tuple(sorted(pieces)))


def _dense_share(voxels: NDArray[Any], within: NDArray[np.bool_]) -> float:
    """Return the share of the voxels of a mask that are as dense as bone."""
    return float(np.mean(voxels[within] > _BONE_HU)) if within.any() else 0.0


def _pieces_outside(
    voxels: NDArray[Any],
    solid: NDArray[np.bool_],
    body: NDArray[np.bool_],
    spacing: NDArray[np.float64],
    depth: float,
) -> tuple[NDArray[np.bool_], list[str]]:
    """Return where the pieces lie that are no part of the body, and each one's size, for people.

    body  what lies near its own cores; pieces that belong to it are added
    """
    labels = cc3d.connected_components(solid & ~body, connectivity=26)
    is_soft = _dense_share(voxels, body) <= _MAX_DENSE_SHARE
    found, sizes = np.zeros(voxels.shape, bool), []
    waiting: list[tuple[int, tuple[slice, ...], NDArray[np.float64], float]] = []
    for number, near, ends in _places_of(labels):
        size = (ends[:, 1] - ends[:, 0] + 1) * spacing
        may_be = np.linalg.norm(size) >= _LENGTH * depth and _comes_in(ends, voxels.shape)
        piece = labels[near] == number
        kind = _kind_of(voxels[near], piece, solid[near], is_soft=is_soft) if may_be else "plain"
        most, most_joined = _LIMITS[kind]
        if np.count_nonzero(piece) > most * np.count_nonzero(body):
            body[near] |= piece
        elif may_be and kind != "bone":
            waiting.append((number, near, size, most_joined))
    for number, near, size, most_joined in waiting:
        piece = labels[near] == number
        if _joined(piece, body[near], solid[near], spacing) > most_joined:
            continue
        if _is_within(labels == number, body):
            continue
        found[near] |= piece
        sizes.append(" x ".join(f"{length / 1000:.0f}" for length in size) + " mm (z, y, x)")
    return found, sizes


def _places_of(
    labels: NDArray[Any],
) -> Iterator[tuple[int, tuple[slice, ...], NDArray[np.int64]]]:
    """Yield each piece's number, the box round it with a margin, and its ends; largest first."""
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


def _kind_of(
    voxels: NDArray[Any], piece: NDArray[np.bool_], solid: NDArray[np.bool_], *, is_soft: bool
) -> Literal["plain", "bone", "table"]:
    """Return whether a piece is of soft material, is or has a bone, or is a dense table.

    is_soft  whether the body is of flesh: then a dense piece that lies in air is no bone of it
    """
    if _dense_share(voxels, piece) <= _BONE_SHARE:
        return "plain"
    if not is_soft:
        return "bone"
    dense = piece & (voxels > _BONE_HU)
    first, last = (ndimage.binary_dilation(dense, iterations=n) for n in _RING)
    ring = last & ~first
    return "table" if ring.any() and float(np.mean(solid[ring])) <= _IN_AIR else "bone"


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
    if 0 < _dense_share(voxels, deep) <= _MAX_DENSE_SHARE:
        deep &= voxels <= _BONE_HU
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


def _comes_in(ends: NDArray[np.int64], shape: tuple[int, ...]) -> bool:
    """Return whether a piece reaches the volume's end: nothing holds it within."""
    return bool((ends[:, 0] == 0).any() or (ends[:, 1] == np.array(shape) - 1).any())


def _is_within(piece: NDArray[np.bool_], body: NDArray[np.bool_]) -> bool:
    """Return whether most of a piece has the body on most sides."""
    sides = np.zeros(np.count_nonzero(piece), np.uint8)
    for axis in range(3):
        for way in (slice(None), slice(None, None, -1)):
            along = tuple(way if k == axis else slice(None) for k in range(3))
            sides += np.logical_or.accumulate(body[along], axis=axis)[along][piece]
    return bool(np.mean(sides >= _MIN_DIRECTIONS) > 0.5)


def _joined(
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
        # the cut-out has a margin but where the volume ends
        joined += area * (np.count_nonzero(along[0]) + np.count_nonzero(along[-1]))
    return joined / (joined + free) if joined + free else 1.0


def _cells_of(mask: NDArray[np.bool_], body: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the mask in fewer cells; one that holds a part of the body is left in."""
    factor = 1
    while np.prod([-(-n // factor) for n in mask.shape]) > _CELLS:
        factor += 1
    if factor == 1:
        return mask
    ends = [(-(-n // factor), n) for n in mask.shape]
    index = [np.arange(n) * cells // n for cells, n in ends]
    held, kept = np.zeros((2, *(cells for cells, _ in ends)), bool)
    for place, target in ((mask, held), (body, kept)):
        np.logical_or.at(
            target, tuple(index[k][one] for k, one in enumerate(place.nonzero())), True
        )
    return held & ~kept
