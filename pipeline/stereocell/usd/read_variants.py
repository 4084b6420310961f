"""Read what an artist has chosen for a tile of a composed stage: its two sets of variants."""

import re
from dataclasses import dataclass
from typing import Literal, get_args

from pxr import Usd, UsdGeom, UsdVol

from stereocell.model.errors import StageError
from stereocell.usd.write_tile import DEFAULT_LOD

Representation = Literal["mesh", "volume", "both"]

_LOD = re.compile(r"lod(\d+)")


@dataclass(frozen=True, slots=True)
class TileChoice:
    """How a tile is to be drawn, and its finest level of detail that anyone is to see.

    `lod1` is what a stage selects by itself, so it says no more than `lod0`: that all levels are
    wanted. A coarser one is a choice.
    """

    representation: Representation
    finest_lod: int


def read_choice(tile: Usd.Prim) -> TileChoice:
    """Return what is chosen for a loaded tile. Raises StageError for a variant that is none."""
    return TileChoice(_representation(tile), _finest_lod(tile))


def lod_levels(tile: Usd.Prim) -> list[int]:
    """Return a loaded tile's levels of detail, finest first; none: a flattened stage."""
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
        f"{tile.GetPath()}: representation {selected!r}, "
        f"expected one of {', '.join(get_args(Representation))}"
    )


def _what_is_active(tile: Usd.Prim) -> Representation:
    """Return what a tile without a choice draws: flattening leaves what was chosen, no variants."""
    prims = list(Usd.PrimRange(tile))  # inactive ones are left out
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
        raise StageError(f"{tile.GetPath()}: lod {selected!r}, expected one of {known}")
    level = int(match[1])
    return level if level > DEFAULT_LOD else 0
