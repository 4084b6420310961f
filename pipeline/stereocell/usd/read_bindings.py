"""Find materials that a layer binds to the specimen, the tiles' group or a tile.

The stage binds a material to each mesh. A material that is bound higher up reaches the meshes only
if its binding is stronger than those of descendants. It does not change volumes: they are drawn by
transfer functions and keep the channels' colours.
"""

from collections.abc import Iterator

from pxr import Sdf, Usd, UsdShade

from stereocell.usd.layer import CHANNELS
from stereocell.usd.read_stage import tile_prims
from stereocell.usd.specimen import specimen_of

_BINDING = "material:binding"
_COLLECTION = "collection"
_TOKENS = UsdShade.Tokens
_EDIT = f"edit inputs:color of {CHANNELS}/NAME, which colours surfaces and volumes"


def notes_on_bindings(stage: Usd.Stage) -> Iterator[str]:
    """Yield a message for each material, bound above the channels, that surfaces are drawn with."""
    specimen = specimen_of(stage)
    groups = (stage.GetPrimAtPath(path) for path in (specimen.root, specimen.tiles))
    for prim in (*groups, *tile_prims(stage)):
        for relationship in prim.GetRelationships():
            name = relationship.GetName()
            is_binding = name == _BINDING or name.startswith(f"{_BINDING}:")
            if is_binding and relationship.GetTargets() and not binding_fault(prim, relationship):
                yield (
                    f"material {_materials(relationship)[-1]}, bound on {prim.GetPath()}, is taken "
                    f"over for surfaces; volumes keep the channels' colours: {_EDIT}"
                )


def binding_fault(prim: Usd.Prim, relationship: Usd.Relationship, *, is_own: bool = False) -> str:
    """Return why a bound material does not affect surfaces; empty: it does, or it was unbound.

    is_own  whether the binding works without the strength `strongerThanDescendants`, as on a mesh,
            because no prim below it has a binding
    """
    if not relationship.GetTargets():
        return ""
    if not _materials(relationship):
        return "the stage has no such material"
    if purpose := _purpose(relationship):
        return f"it is bound only for the purpose {purpose!r}: {_EDIT}"
    strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(relationship)
    if strength != _TOKENS.strongerThanDescendants and not is_own:
        return f"the channels' own materials are stronger: {_EDIT}"
    return ""


def _materials(relationship: Usd.Relationship) -> list[Sdf.Path]:
    stage = relationship.GetStage()
    return [path for path in relationship.GetTargets() if UsdShade.Material.Get(stage, path)]


def _purpose(relationship: Usd.Relationship) -> str:
    """Return the purpose that a binding is restricted to; empty: all purposes."""
    parts = relationship.GetName().split(":")[2:]
    if parts[:1] == [_COLLECTION]:  # "collection", an optional purpose, the binding's name
        parts = parts[1:-1]
    return parts[0] if parts else ""
