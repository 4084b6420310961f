"""Read which variants of a tile are selected: its representation and its level of detail."""

import re
from dataclasses import dataclass
from typing import get_args

from pxr import Usd, UsdGeom, UsdVol

from stereocell.model.errors import StageError
from stereocell.model.tile_content import Representation
from stereocell.usd.write_tile import DEFAULT_LOD

_LOD = re.compile(r"lod(\d+)")


@dataclass(frozen=True, slots=True)
class TileChoice:
    """The representation of a tile to draw, and the finest level of detail to show.

    finest_lod  0: show all levels. A stage selects `lod1` by default, so `lod1` also gives 0. Only
                a coarser level counts as an artist's choice.
    """

    representation: Representation
    finest_lod: int


def read_choice(tile: Usd.Prim) -> TileChoice:
    """Return the selected variants of a loaded tile. Raises StageError for an unknown variant."""
    return TileChoice(_representation(tile), _finest_lod(tile))


def lod_levels(tile: Usd.Prim) -> list[int]:
    """Return a loaded tile's levels of detail, finest first; empty: there are no variants."""
    names = tile.GetVariantSet("lod").GetVariantNames()
    return sorted(int(match[1]) for match in map(_LOD.fullmatch, names) if match)


def _representation(tile: Usd.Prim) -> Representation:
    selected = tile.GetVariantSet("representation").GetVariantSelection()
    if not selected:
        return _what_is_active(tile)
    for known in get_args(Representation):
        if selected == known:
            return known
    raise StageError(
        f"{tile.GetPath()}: representation is {selected!r}, "
        f"expected one of {', '.join(get_args(Representation))}"
    )


def _what_is_active(tile: Usd.Prim) -> Representation:
    """Return the representation of a flattened tile, which has no variants, by its prims."""
    prims = list(Usd.PrimRange(tile))  # without inactive prims
    has_volume = any(prim.IsA(UsdVol.Volume) for prim in prims)
    if not has_volume:
        return "mesh"
    return "both" if any(prim.IsA(UsdGeom.Mesh) for prim in prims) else "volume"


def _finest_lod(tile: Usd.Prim) -> int:
    selected = tile.GetVariantSet("lod").GetVariantSelection()
    if not selected:
        return 0
    levels = lod_levels(tile)
    match = _LOD.fullmatch(selected)
    if match is None or int(match[1]) not in levels:
        known = ", ".join(f"lod{level}" for level in levels)
        raise StageError(f"{tile.GetPath()}: lod is {selected!r}, expected one of {known}")
    level = int(match[1])
    return level if level > DEFAULT_LOD else 0
