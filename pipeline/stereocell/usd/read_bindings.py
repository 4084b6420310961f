"""Which materials that a layer binds above the channels reach the surfaces of a bundle.

The stage binds a material on each mesh. One that is bound on the specimen, the group of tiles or a
tile reaches the meshes if it is bound as stronger than its descendants. Volumes have transfer
functions in the place of materials, so they keep the channels' colours.
"""

from collections.abc import Iterator

from pxr import Sdf, Usd, UsdShade

from stereocell.usd.layer import CHANNELS
from stereocell.usd.read_stage import tile_prims
from stereocell.usd.specimen import specimen_of

_BINDING = "material:binding"
_COLLECTION = "collection"
_TOKENS = UsdShade.Tokens
_EDIT = f"inputs:color of {CHANNELS}/NAME changes surfaces and volumes"


def notes_on_bindings(stage: Usd.Stage) -> Iterator[str]:
    """Yield a sentence on each material above the channels that the surfaces take over."""
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
    """Return why a material that is bound on a prim reaches no surface; empty: it reaches those
    below.

    is_own  whether the prim is a surface's mesh, which has no stronger binding
    """
    if not relationship.GetTargets():
        return ""
    if not _materials(relationship):
        return "there is no such material"
    if purpose := _purpose(relationship):
        return f"it is bound for the purpose {purpose!r} alone; {_EDIT}"
    strength = UsdShade.MaterialBindingAPI.GetMaterialBindingStrength(relationship)
    if strength != _TOKENS.strongerThanDescendants and not is_own:
        return f"the channels' own materials are stronger; {_EDIT}"
    return ""


def _materials(relationship: Usd.Relationship) -> list[Sdf.Path]:
    stage = relationship.GetStage()
    return [path for path in relationship.GetTargets() if UsdShade.Material.Get(stage, path)]


def _purpose(relationship: Usd.Relationship) -> str:
    """Return the purpose that a binding is restricted to; empty: it is for all."""
    parts = relationship.GetName().split(":")[2:]
    if parts[:1] == [_COLLECTION]:  # then comes the binding's own name, behind a purpose if any
        parts = parts[1:-1]
    return parts[0] if parts else ""
