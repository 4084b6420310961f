"""Walk the opinions that a user's layers add over a built stage.

All layers of the composition are examined: the opened layer, its sublayers, and layers that come
in by references and payloads. Layers that a build wrote are left out. Their folder is found by
contents.usda, which has the channels' appearances as a sublayer. A flattened stage has no such
layer, so it is not possible to distinguish its edits from the build.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from pxr import Sdf, Usd, UsdGeom, UsdUtils

from stereocell.usd.specimen import specimen_of
from stereocell.usd.write_stage import SUBLAYERS
from stereocell.usd.write_tile import LAYER_NAME
from stereocell.usd.written_files import CONTENTS_NAME, NVINDEX_NAME, STAGE_NAME

# Fields that USD itself uses when it composes prims
_COMPOSITION = frozenset(
    (
        "specifier",
        "typeName",
        "references",
        "payload",
        "inheritPaths",
        "specializes",
        "variantSetNames",
        "variantSelection",
        "apiSchemas",
        "instanceable",
        "relocates",
        "primOrder",
        "propertyOrder",
        "permission",
    )
)
# Notes for readers of the layer, and hints for the display in editors
_NOTES = frozenset(("documentation", "comment", "hidden", "userDocBrief", "uiHints"))
# Variant sets of the build. The readers of a stage read all variants, not only the selected one.
_ALL_READ = frozenset(("lod", "representation", "transferFunction"))
BELOW_INSTANCE = "@below an instance"  # name of an opinion that USD ignores, below an instance
# All prims, including those of instances
_EVERY = Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)
_DEFINED = Usd.TraverseInstanceProxies(
    Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract
)  # prims whether or not their payloads are loaded


@dataclass(frozen=True, slots=True)
class Opinion:
    """An opinion of one layer, and the composed prim that it applies to.

    prim         path of the composed prim
    name         name of the property, or `@` and the name of the prim's metadata
    spec         the property or the prim in the layer
    variant      the variant that holds the opinion, if no reader sees that variant; else empty
    is_unlisted  whether the layer does not list the variant set, so that USD ignores the variant
    """

    prim: Sdf.Path
    name: str
    spec: Sdf.Spec
    variant: str = ""
    is_unlisted: bool = False

    @property
    def source(self) -> tuple[str, str]:
        """The layer, and the opinion's path and name in it: a key for the opinion."""
        return self.spec.layer.identifier, f"{self.spec.path} {self.name}"


class BuiltLayers:
    """The layers of a stage that a build wrote. `bool()` of it is False if there are none."""

    def __init__(self, stage: Usd.Stage) -> None:
        self._folders = {
            Path(layer.realPath).parent
            for layer in stage.GetUsedLayers()
            if layer.realPath and SUBLAYERS[0] in layer.subLayerPaths
        }

    def __bool__(self) -> bool:
        return bool(self._folders)

    def __contains__(self, layer: Sdf.Layer) -> bool:
        file = Path(layer.realPath)
        for folder in self._folders:
            if file.is_relative_to(folder):
                inside = file.relative_to(folder)
                is_look = f"./{inside.as_posix()}" in SUBLAYERS
                is_tile = inside.name == LAYER_NAME and inside.parts[:1] == ("tiles",)
                is_stage = str(inside) in (STAGE_NAME, CONTENTS_NAME, NVINDEX_NAME)
                if is_look or is_tile or is_stage:
                    return True
        return False


def load_payloads_of_users(stage: Usd.Stage) -> None:
    """Load the payloads that a user's layers add, and the tiles below which they state anything.

    USD does not compose prims below a payload that is not loaded.
    """
    built = BuiltLayers(stage)
    if all(layer in built for layer in _layers(stage)):
        return
    tiles = specimen_of(stage).tiles
    for path in stage.FindLoadable():
        if not _is_in_tile(path, tiles) or _is_touched_below(stage.GetPrimAtPath(path), built):
            _load(stage, path)


def defined_prims(stage: Usd.Stage) -> Iterator[Usd.Prim]:
    """Yield all active and defined prims, including those of instances and of users' payloads.

    Prims below a PointInstancer are left out: prototypes have no place of their own. Payloads that
    users add stay loaded.
    """
    load_payloads_of_users(stage)
    prims = iter(Usd.PrimRange(stage.GetPseudoRoot(), _DEFINED))
    for prim in prims:
        if prim.IsA(UsdGeom.PointInstancer):
            prims.PruneChildren()
        yield prim


def _is_in_tile(path: Sdf.Path, tiles: Sdf.Path) -> bool:
    return bool(path.HasPrefix(tiles)) and path != tiles


def _is_touched_below(prim: Usd.Prim, built: BuiltLayers) -> bool:
    return any(spec.nameChildren or spec.variantSets for spec in _specs_of_users(prim, built))


def opinions_of_users(stage: Usd.Stage, built: BuiltLayers) -> Iterator[tuple[Usd.Prim, Opinion]]:
    """Yield each opinion of a user's layer with its composed prim, while its tile is loaded."""
    if all(layer in built for layer in _layers(stage)):
        return
    for prim in _composed_prims(stage, built):
        for spec in _specs_of_users(prim, built):
            for opinion in _opinions(spec, prim, built):
                yield prim, opinion


def _layers(stage: Usd.Stage) -> list[Sdf.Layer]:
    return [layer for layer in stage.GetUsedLayers() if layer != stage.GetSessionLayer()]


def _specs_of_users(prim: Usd.Prim, built: BuiltLayers) -> list[Sdf.PrimSpec]:
    session = prim.GetStage().GetSessionLayer()
    return [
        spec for spec in prim.GetPrimStack() if spec.layer != session and spec.layer not in built
    ]


def _load(stage: Usd.Stage, path: Sdf.Path) -> None:
    """Load a payload and those below it. A payload above the tiles does not load the tiles."""
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # the readers raise USD's errors
    is_above = specimen_of(stage).tiles.HasPrefix(path)
    stage.Load(path, Usd.LoadWithoutDescendants if is_above else Usd.LoadWithDescendants)
    del quiet


def _composed_prims(stage: Usd.Stage, built: BuiltLayers) -> Iterator[Usd.Prim]:
    """Yield all prims, except of tiles without edits. Loads the edited tiles one by one."""
    tiles = specimen_of(stage).tiles
    for path in stage.FindLoadable():
        if not _is_in_tile(path, tiles):
            _load(stage, path)
    for top in stage.GetPseudoRoot().GetFilteredChildren(Usd.PrimAllPrimsPredicate):
        yield from _walk(top, tiles, built)


def _walk(prim: Usd.Prim, tiles: Sdf.Path, built: BuiltLayers) -> Iterator[Usd.Prim]:
    path, stage = prim.GetPath(), prim.GetStage()
    if not tiles.HasPrefix(path):
        yield from Usd.PrimRange(prim, _EVERY)
        return
    yield prim
    for child in [one.GetPath() for one in prim.GetFilteredChildren(Usd.PrimAllPrimsPredicate)]:
        if path != tiles:
            yield from _walk(stage.GetPrimAtPath(child), tiles, built)
        elif _specs_of_users(stage.GetPrimAtPath(child), built):
            yield from _loaded_prims(stage, child)


def _loaded_prims(stage: Usd.Stage, path: Sdf.Path) -> Iterator[Usd.Prim]:
    is_loaded = path in stage.GetLoadSet() or not stage.GetPrimAtPath(path).IsActive()
    if not is_loaded:
        _load(stage, path)
    yield from Usd.PrimRange(stage.GetPrimAtPath(path), _EVERY)
    if not is_loaded:
        stage.Unload(path)


def _opinions(spec: Sdf.PrimSpec, prim: Usd.Prim, built: BuiltLayers) -> Iterator[Opinion]:
    path = prim.GetPath()
    yield from _own_opinions(spec, path, "")
    if prim.IsInstance() and spec.path == path:
        for child in spec.nameChildren:
            yield Opinion(path.AppendChild(child.name), BELOW_INSTANCE, child)
    for set_name, variants in spec.variantSets.items():
        selected = prim.GetVariantSet(set_name).GetVariantSelection()
        is_listed = _is_listed(prim, spec.path, set_name, built)
        for variant in variants.variants.values():
            words = f"{variant.name!r} of {set_name}"
            if not is_listed:
                for opinion in _tree_of_variant(variant.primSpec, path, words):
                    yield replace(opinion, is_unlisted=True)
            elif variant.name != selected:
                words = "" if set_name in _ALL_READ else words
                yield from _tree_of_variant(variant.primSpec, path, words)


def _is_listed(prim: Usd.Prim, path: Sdf.Path, name: str, built: BuiltLayers) -> bool:
    """Return whether a user's layer lists a variant set at a path; if not, USD ignores the set."""
    specs = [spec for spec in _specs_of_users(prim, built) if spec.path == path]
    return any(name in spec.variantSetNameList.GetAppliedItems() for spec in specs)


def _tree_of_variant(spec: Sdf.PrimSpec, path: Sdf.Path, variant: str) -> Iterator[Opinion]:
    yield from _own_opinions(spec, path, variant)
    for child in spec.nameChildren:
        yield from _tree_of_variant(child, path.AppendChild(child.name), variant)


def _own_opinions(spec: Sdf.PrimSpec, path: Sdf.Path, variant: str) -> Iterator[Opinion]:
    for key in spec.ListInfoKeys():
        if key not in _COMPOSITION and key not in _NOTES:
            yield Opinion(path, f"@{key}", spec, variant)
    for prop in spec.properties:
        if _states_value(prop):
            yield Opinion(path, prop.name, prop, variant)
    if spec.specifier == Sdf.SpecifierDef:
        yield Opinion(path, "@specifier", spec, variant)


def _states_value(prop: Sdf.PropertySpec) -> bool:
    """Return whether a property has a value, connections or targets and is not only declared."""
    if isinstance(prop, Sdf.RelationshipSpec):
        return prop.HasInfo("targetPaths")
    return bool({"default", "timeSamples", "spline", "connectionPaths"} & set(prop.ListInfoKeys()))
