"""The step that gathers the evidence for a channel's level in one tile."""

import base64
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stereocell.engine.step import Document, Step
from stereocell.filters.denoise import denoise_slices
from stereocell.isosurface.axis_profiles import Profiles
from stereocell.isosurface.edge_criteria import EdgeSums
from stereocell.isosurface.level_evidence import (
    HALO,
    Counting,
    Sums,
    TileEvidence,
    denoising_reach,
    find_padding,
    gather_evidence,
)
from stereocell.isosurface.neighbours import Neighbours
from stereocell.isosurface.options import CRITERIA
from stereocell.model.image_plane import back_of_three, first_of_three, in_order, slices_first
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.steps.open_source import Voxels, open_source
from stereocell.steps.units_again import AGAIN


def evidence_of(task: "GatherEvidence", volume: Volume, window: Box) -> TileEvidence:
    """Return a tile's evidence from the volume that was read in a window around it."""
    spacing, axis = volume.spacing_um, volume.slice_axis
    reach = denoising_reach(task.smoothing_um, spacing, axis)
    own = task.box.slices_in(window)
    voxels = in_order(slices_first(volume.voxels, axis))

    def background(first: int, stop: int) -> NDArray[np.float32]:
        assert task.background is not None
        start = window.start[axis]
        return slices_first(
            task.background.at(window.slab(axis, start + first, start + stop)), axis
        )

    return gather_evidence(
        denoise_slices(volume, task.smoothing_um),
        find_padding(voxels, task.counting.darkest, first_of_three(reach, axis)),
        first_of_three(own, axis),
        voxels=voxels,
        spacing_um=first_of_three(spacing, axis),
        counting=task.counting,
        start=first_of_three(task.box.start, axis),
        background=None if task.background is None else background,
        criterion=CRITERIA.get(task.criterion),
    )


def evidence_to_json(evidence: TileEvidence) -> dict[str, Any]:
    """Return a tile's evidence as texts and numbers."""
    edges = evidence.edges
    return {
        "plain": _sums_to_json(evidence.plain),
        "padding": _sums_to_json(evidence.padding),
        "above": None if evidence.above is None else _sums_to_json(evidence.above),
        "differences": _pack(evidence.differences),
        "profiles": [
            None
            if one is None
            else {
                "start": list(one.start),
                "sums": [_pack(part) for part in one.sums],
                "counts": [_pack(part) for part in one.counts],
            }
            for one in evidence.profiles or (None, None)
        ],
        "neighbours": None
        if evidence.neighbours is None
        else {
            "voxels": _pack(evidence.neighbours.voxels),
            "pairs": _pack(evidence.neighbours.pairs),
        },
        "edges": None
        if edges is None
        else [
            None if one is None else {"areas": _pack(one.areas), "totals": _pack(one.totals)}
            for one in edges
        ],
    }


def evidence_from_json(content: Mapping[str, Any]) -> TileEvidence:
    """Return the evidence from the output of `evidence_to_json`, after its schema was checked."""
    edges = content["edges"]
    plain, above = (
        None if one is None else EdgeSums(_unpack(one["areas"]), _unpack(one["totals"]))
        for one in edges or (None, None)
    )
    along, along_above = (_profiles_from_json(one) for one in content["profiles"])
    return TileEvidence(
        _sums_from_json(content["plain"]),
        _sums_from_json(content["padding"]),
        None if content["above"] is None else _sums_from_json(content["above"]),
        _unpack(content["differences"]).astype(np.int64),
        None if along is None else (along, along_above),
        _neighbours_from_json(content["neighbours"]),
        None if plain is None else (plain, above),
    )


def _profiles_from_json(content: Mapping[str, Any] | None) -> Profiles | None:
    if content is None:
        return None
    z, y, x = content["start"]
    sz, sy, sx = (_unpack(part) for part in content["sums"])
    nz, ny, nx = (_unpack(part).astype(np.int64) for part in content["counts"])
    return Profiles((z, y, x), (sz, sy, sx), (nz, ny, nx))


def _neighbours_from_json(content: Mapping[str, str] | None) -> Neighbours | None:
    if content is None:
        return None
    return Neighbours(_unpack(content["voxels"]), _unpack(content["pairs"]).reshape(2, 2))


def _sums_to_json(sums: Sums) -> dict[str, str]:
    names = ("counts", "slopes", "squares")
    return {name: _pack(getattr(sums, name)) for name in names}


def _sums_from_json(content: Mapping[str, str]) -> Sums:
    slopes, squares = (_unpack(content[name]) for name in ("slopes", "squares"))
    return Sums(_unpack(content["counts"]).astype(np.int64), slopes, squares)


def _pack(values: NDArray[Any]) -> str:
    """Return numbers as text: little-endian float64, zlib, base64. Counts stay exact."""
    return base64.b64encode(zlib.compress(values.astype("<f8").tobytes(), 6)).decode()


def _unpack(text: str) -> NDArray[np.float64]:
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), "<f8").astype(np.float64)


@dataclass(frozen=True, slots=True)
class GatherEvidence(Step[TileEvidence]):
    """Gather the evidence of one tile, or of another box of the region.

    box         voxels of the tile
    region      voxels that are built
    background  background near the tile, voxel values; None: none is subtracted
    criterion   name of the criterion that scores edges; empty: none does
    """

    VERSION: ClassVar[int] = 2
    FORM: ClassVar[Document[TileEvidence]] = Document(
        "units.schema.json#Evidence", evidence_to_json, evidence_from_json, AGAIN
    )

    voxels: Voxels
    box: Box
    region: Box
    smoothing_um: float
    counting: Counting
    background: LatticeField | None
    criterion: str

    def run(self) -> TileEvidence:
        """Read the tile with its halo, and return its evidence. Raises SourceError."""
        level, dataset = self.voxels.level, open_source(self.voxels.ref)
        spacing, axis = dataset.levels[level].spacing_um, dataset.slice_axis(level)
        reach = denoising_reach(self.smoothing_um, spacing, axis)
        z, y, x = (r + h for r, h in zip(reach, back_of_three(HALO, axis), strict=True))
        window = self.box.grown((z, y, x), self.region)
        return evidence_of(self, self.voxels.read(window), window)
