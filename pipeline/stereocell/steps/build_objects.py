"""The step that builds the objects of one tile of a label map."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stereocell.engine.step import Step
from stereocell.model.lattice import Lattice
from stereocell.model.mesh import Lod
from stereocell.model.tiling import Box
from stereocell.model.timing import Clock
from stereocell.model.unit import ObjectFacts, Unit
from stereocell.model.volume import xyz_to_zyx
from stereocell.objects.build_objects import BuiltObjects, build_objects
from stereocell.objects.extents import Runs
from stereocell.objects.intensities import QUANTILES, Intensities, measure_intensities
from stereocell.objects.options import ObjectOptions
from stereocell.read.decoded_chunks import forget_chunks
from stereocell.steps.labels import Labels
from stereocell.steps.open_source import Voxels
from stereocell.steps.unit_files import UNIT_FOLDER, UnitFolder
from stereocell.textures.sample_channel import sample_channel


@dataclass(frozen=True, slots=True)
class Image:
    """An image channel that is measured over objects.

    region  box (z, y, x) of the channel's voxels that is built
    """

    voxels: Voxels
    region: Box


@dataclass(frozen=True, slots=True)
class Painted:
    """An image channel that is painted on objects.

    window    voxel values that become 0 and 1
    depth_um  depth below the surface within which the largest intensity is taken
    """

    image: Image
    window: tuple[float, float]
    depth_um: float


@dataclass(frozen=True, slots=True)
class BuildObjects(Step[Unit]):
    """Build the objects of one tile of a label map.

    window      voxels of the label map to read; None: the tile has no object
    tile        voxels of the label map that belong to the tile
    whole       uint64 (n,), ascending: labels of objects that are built as a whole
    cut         uint64 (n,), ascending: labels of objects that are cut at the planes between tiles;
                their part inside the tile is built
    others      uint64 (n,), ascending: labels in the window that other tiles build. Labels that are
                not listed are left out
    others_cut  uint64 (n,), ascending: the labels of `others` that are cut
    edges       for each axis (z, y, x), indices of voxels where tiles begin
    step_um     step of the lattice that vertices lie on
    images      channels that are measured over the objects
    painted     channel that is painted on the objects; None: none is
    """

    VERSION: ClassVar[int] = 2
    FORM: ClassVar[UnitFolder] = UNIT_FOLDER

    labels: Labels
    window: Box | None
    tile: Box
    whole: NDArray[np.uint64]
    cut: NDArray[np.uint64]
    others: NDArray[np.uint64]
    others_cut: NDArray[np.uint64]
    edges: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]
    step_um: float
    images: tuple[Image, ...]
    painted: Painted | None
    options: ObjectOptions

    def run(self) -> Unit:
        """Return the objects as a unit. Raises SourceError."""
        return _build(self)


def _build(task: BuildObjects) -> Unit:
    clock = Clock()
    if task.window is None:
        return Unit((), None, None, "no object", 0, 0, {}, objects=_none(task))
    start = time.perf_counter()
    voxels = task.labels.open().read(task.window)
    forget_chunks()  # objects need more memory than the passes before them
    compact, names = _numbered(task, voxels)
    del voxels
    clock.seconds["read"] = time.perf_counter() - start
    is_whole = np.isin(names.labels, task.whole)
    is_piece = np.isin(names.labels, task.cut) & (names.tiles == names.own_tile)
    owned = np.flatnonzero(is_whole | is_piece).astype(np.int32)
    built = build_objects(
        compact,
        owned,
        spacing_um=task.labels.spacing_um,
        origin_um=task.labels.position_um(task.window.start),
        step_um=task.step_um,
        options=task.options,
        clock=clock,
    )
    thin = names.labels[built.thin]
    owned = np.setdiff1d(owned, built.thin).astype(np.int32)
    with clock("intensities"):
        pieces = owned[is_piece[owned]]
        measured = [
            measure_intensities(
                compact, read_on_labels(task.labels, task.window, image), owned, pieces=pieces
            )
            for image in task.images
        ]
    facts = _facts(built, owned, names, measured, compact, thin)
    reason = "" if built.lods else "no object"
    lods = built.lods
    if task.painted is not None:
        with clock("paint"):
            lods = _paint(lods, task.painted)
    return Unit(lods, None, None, reason, 0, 0, clock.seconds, objects=facts)


@dataclass(frozen=True, slots=True)
class _Names:
    """The labels and tiles that the compact numbers of a window stand for. 0 means no object.

    labels    uint64 (n + 1,): label of each number
    tiles     int64 (n + 1,): for the piece of a cut object, the tile that it lies in, counted in C
              order of the tiles' places; -1: not a piece
    own_tile  the tile that is built, counted in the same way
    """

    labels: NDArray[np.uint64]
    tiles: NDArray[np.int64]
    own_tile: int


def _numbered(
    task: BuildObjects, voxels: NDArray[np.unsignedinteger]
) -> tuple[NDArray[np.int32], _Names]:
    """Return the window with numbers from 1 in place of labels. Each piece has its own number."""
    assert task.window is not None
    kept = np.sort(np.concatenate([task.whole, task.cut, task.others]))
    runs = Runs.of(voxels)
    values = runs.values.astype(np.uint64)
    place = np.searchsorted(kept, values).clip(0, max(len(kept) - 1, 0))
    known = (kept[place] == values) & (values > 0) if len(kept) else np.zeros(len(values), bool)
    of_run = np.where(known, place + 1, 0).astype(np.int32)
    compact = runs.spread(of_run).reshape(voxels.shape)
    labels = np.concatenate([np.zeros(1, np.uint64), kept])
    tiles = np.full(len(labels), -1, np.int64)
    counts = [len(edges) + 1 for edges in task.edges]
    own = [
        int(np.searchsorted(edges, start, side="right"))
        for edges, start in zip(task.edges, task.tile.start, strict=True)
    ]
    own_tile = (own[0] * counts[1] + own[1]) * counts[2] + own[2]
    cut = np.concatenate([task.cut, task.others_cut])
    is_cut = np.isin(labels, cut)
    if not is_cut.any():
        return compact, _Names(labels, tiles, own_tile)
    which = is_cut[compact]
    planes = [
        np.searchsorted(edges, np.arange(a, b), side="right")
        for edges, a, b in zip(task.edges, task.window.start, task.window.stop, strict=True)
    ]
    z, y, x = np.nonzero(which)
    at = (planes[0][z] * counts[1] + planes[1][y]) * counts[2] + planes[2][x]
    pairs = compact[which].astype(np.int64) * int(np.prod(counts)) + at
    pieces, number = np.unique(pairs, return_inverse=True)
    compact[which] = len(labels) + number.ravel().astype(np.int32)
    of_piece, tile_of_piece = np.divmod(pieces, int(np.prod(counts)))
    return compact, _Names(
        np.concatenate([labels, labels[of_piece]]),
        np.concatenate([tiles, tile_of_piece]),
        own_tile,
    )


def read_on_labels(labels: Labels, window: Box, image: Image) -> NDArray[Any]:
    """Return a channel's nearest voxel at each voxel of a window of a label map, (z, y, x)."""
    indices = []
    for axis in range(3):
        first = labels.origin_um[axis] - image.voxels.origin_um[axis]
        at = np.arange(window.start[axis], window.stop[axis])
        nearest = np.rint((first + at * labels.spacing_um[axis]) / image.voxels.spacing_um[axis])
        first_voxel, last_voxel = image.region.start[axis], image.region.stop[axis] - 1
        indices.append(nearest.astype(np.int64).clip(first_voxel, last_voxel))
    z0, y0, x0 = (int(part.min()) for part in indices)
    z1, y1, x1 = (int(part.max()) + 1 for part in indices)
    voxels = image.voxels.read(Box((z0, y0, x0), (z1, y1, x1))).voxels
    for axis, (part, start) in enumerate(zip(indices, (z0, y0, x0), strict=True)):
        if len(part) != voxels.shape[axis] or (np.diff(part) != 1).any():
            voxels = np.take(voxels, part - start, axis)
    return voxels


def _paint(lods: Sequence[Lod], painted: Painted) -> tuple[Lod, ...]:
    """Return the levels of detail with the intensity of a channel at their vertices."""
    if not lods:
        return ()
    image, own = painted.image, painted.image.voxels
    spacing, origin = np.array(own.spacing_um), np.array(own.origin_um)
    corners = [xyz_to_zyx(lod.mesh.positions.astype(np.float64)) for lod in lods]
    low = np.min([at.min(axis=0) for at in corners], axis=0) - painted.depth_um
    high = np.max([at.max(axis=0) for at in corners], axis=0) + painted.depth_um
    first, last = np.array(image.region.start), np.array(image.region.stop) - 1
    start = np.floor((low - origin) / spacing).astype(np.int64).clip(first, last)
    stop = np.ceil((high - origin) / spacing).astype(np.int64).clip(first, last) + 1
    (z0, y0, x0), (z1, y1, x1) = start.tolist(), stop.tolist()
    box = Box((z0, y0, x0), (z1, y1, x1))
    volume = own.read(box)
    lattice = Lattice.of_whole(box, own.spacing_um, origin_um=own.origin_um)
    return tuple(
        replace(
            lod,
            mesh=replace(
                lod.mesh,
                paint=sample_channel(
                    volume,
                    lattice,
                    lod.mesh,
                    intensity_window=painted.window,
                    depth_um=painted.depth_um,
                ),
            ),
        )
        for lod in lods
    )


def _facts(
    built: BuiltObjects,
    owned: NDArray[np.int32],
    names: _Names,
    measured: Sequence[Intensities],
    compact: NDArray[np.int32],
    thin: NDArray[np.uint64],
) -> ObjectFacts:
    labels = names.labels[owned]
    beside = names.labels[built.interfaces[:, 1]]
    own = labels[built.interfaces[:, 0]] == beside  # interfaces between pieces of the same object
    cut_um2 = np.bincount(built.interfaces[own, 0], built.interface_um2[own], len(owned))
    pairs = np.stack([built.interfaces[:, 0].astype(np.uint64), beside], axis=1)[~own]
    found, which = np.unique(pairs, axis=0, return_inverse=True)
    voxels = np.bincount(compact.ravel(), minlength=len(names.labels))[owned]
    is_piece = names.tiles[owned] >= 0
    means = (
        np.stack([one.mean for one in measured], axis=1) if measured else np.zeros((len(owned), 0))
    )
    p95s = np.stack([one.p95 for one in measured], axis=1) if measured else means.copy()
    p95s[is_piece] = np.nan
    shape = (int(is_piece.sum()), 0, QUANTILES)
    quantiles = [one.quantiles for one in measured]
    held = np.stack(quantiles, axis=1) if quantiles else np.zeros(shape, np.float32)
    return ObjectFacts(
        labels,
        voxels.astype(np.int64),
        built.areas_um2 - cut_um2,
        found[:, 0].astype(np.int32),
        found[:, 1],
        np.bincount(which.ravel(), built.interface_um2[~own], len(found)).astype(np.float64),
        means,
        p95s,
        np.flatnonzero(is_piece).astype(np.int32),
        held,
        built.changed,
        built.largest_bias,
        built.stopped,
        thin,
    )


def _none(task: BuildObjects) -> ObjectFacts:
    nothing = np.zeros(0)
    by_channel = np.zeros((0, len(task.images)))
    return ObjectFacts(
        np.zeros(0, np.uint64),
        np.zeros(0, np.int64),
        nothing,
        np.zeros(0, np.int32),
        np.zeros(0, np.uint64),
        nothing,
        by_channel,
        by_channel,
        np.zeros(0, np.int32),
        np.zeros((0, len(task.images), QUANTILES), np.float32),
        0,
        (),
        (),
        np.zeros(0, np.uint64),
    )
