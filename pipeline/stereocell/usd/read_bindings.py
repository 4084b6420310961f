"""Materials that a layer binds above the channels: what a bundle takes of them, in notes.

The stage binds a material on each mesh. One that is bound on the specimen, the group of tiles or a
tile reaches the meshes if it is bound as stronger than its descendants. Volumes have transfer
functions in the place of materials, so they keep the channels' colours.
"""

from collections.abc import Iterator

from pxr import Usd, UsdShade

from stereocell.usd.layer import CHANNELS, ROOT, TILES
from stereocell.usd.read_stage import tile_prims

_BINDING = "material:binding"
_COLLECTION = "collection"
_TOKENS = UsdShade.Tokens


def notes_on_bindings(stage: Usd.Stage) -> Iterator[str]:
    """Yield a sentence on each material that is bound above the channels."""
    groups = (stage.GetPrimAtPath(path) for path in (ROOT, TILES))
    for prim in (*groups, *tile_prims(stage)):
        for relationship in prim.GetRelationships():
            name = relationship.GetName()
            if name == _BINDING or name.startswith(f"{_BINDING}:"):
                yield from _notes(prim, relationship)


def _notes(prim: Usd.Prim, relationship: Usd.Relationship) -> Iterator[str]:
    targets = relationship.GetTargets()
    materials = [path for path in targets if UsdShade.Material.Get(prim.GetStage(), path)]
    if not targets:
        return
    words = f"material {materials[-1] if materials else targets[-1]}, bound on {prim.GetPath()},"
    edit = f"inputs:color of {CHANNELS}/NAME changes surfaces and volumes"
    purpose = _purpose(relationship)
    strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(relationship)
    if not materials:
        yield f"{words} is not taken over: there is no such material"
    elif purpose:
        yield f"{words} is not taken over: it is bound for the purpose {purpose!r} alone; {edit}"
    elif strength != _TOKENS.strongerThanDescendants:
        yield f"{words} is not taken over: the channels' own materials are stronger; {edit}"
    else:
        yield f"{words} is taken over for surfaces; volumes keep the channels' colours: {edit}"


def _purpose(relationship: Usd.Relationship) -> str:
    """Return the purpose that a binding is restricted to; empty: it is for all."""
    parts = relationship.GetName().split(":")[2:]
    if parts[:1] == [_COLLECTION]:  # then comes the binding's own name, behind a purpose if any
        parts = parts[1:-1]
    return parts[0] if parts else ""
