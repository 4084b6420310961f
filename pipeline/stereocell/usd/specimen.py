"""Where the specimen stands in a composed stage.

A build writes it at /Specimen. A scene may reference the stage anywhere, under any name: then
`find_specimen` looks for the one prim with the specimen's API schema. The place is kept in the
session layer of the opened stage, from where all readers take it.
"""

from dataclasses import dataclass
from pathlib import Path

from pxr import Sdf, Usd

from stereocell.model.errors import StageError
from stereocell.usd.layer import (
    CAMERAS,
    CHANNELS,
    CLASSES,
    LIGHTS,
    ROOT,
    SHOWN,
    SPECIMEN_API,
    TILES,
)

_KEY = "stereocellSpecimen"  # custom data of the session layer: path of the specimen's prim
# Prims of instances too
_PREDICATE = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract)


@dataclass(frozen=True, slots=True)
class Specimen:
    """The paths of a specimen's prims."""

    root: Sdf.Path = ROOT

    def _moved(self, built: Sdf.Path) -> Sdf.Path:
        return built.ReplacePrefix(ROOT, self.root)

    @property
    def channels(self) -> Sdf.Path:
        """The group of the channels' materials."""
        return self._moved(CHANNELS)

    @property
    def shown(self) -> Sdf.Path:
        """The group of prims whose visibility the channels' surfaces inherit."""
        return self._moved(SHOWN)

    @property
    def classes(self) -> Sdf.Path:
        """The group of the materials of objects' classes."""
        return self._moved(CLASSES)

    @property
    def tiles(self) -> Sdf.Path:
        """The group of the tiles."""
        return self._moved(TILES)

    @property
    def cameras(self) -> Sdf.Path:
        """The group of the cameras."""
        return self._moved(CAMERAS)

    @property
    def lights(self) -> Sdf.Path:
        """The group of the lights."""
        return self._moved(LIGHTS)

    @property
    def top(self) -> str:
        """The name of the root prim that is the specimen, or is above it."""
        return str(self.root.GetPrefixes()[0].name)


def specimen_of(stage: Usd.Stage) -> Specimen:
    """Return the specimen of a stage that was opened by `open_stage`."""
    kept = stage.GetSessionLayer().customLayerData.get(_KEY)
    return Specimen(Sdf.Path(kept)) if kept else Specimen()


def find_specimen(stage: Usd.Stage) -> Specimen:
    """Find the specimen of a stage, and keep its place for `specimen_of`.

    Payloads above it are loaded. Raises StageError where there are several, or where it is an
    instance, whose tiles can't be loaded one by one.
    """
    if stage.GetPrimAtPath(CHANNELS):
        _require_no_instance(stage.GetPrimAtPath(ROOT))
        return Specimen()
    found = _roots(stage)
    if len(found) > 1:
        raise StageError(
            f"{stage.GetRootLayer().realPath}: found {len(found)} specimens, "
            f"{', '.join(map(str, found))}, expected one: deactivate the others in a layer over it"
        )
    if not found:
        return Specimen()
    _require_no_instance(stage.GetPrimAtPath(found[0]))
    layer = stage.GetSessionLayer()
    layer.customLayerData = {**layer.customLayerData, _KEY: str(found[0])}
    return Specimen(found[0])


def _roots(stage: Usd.Stage) -> list[Sdf.Path]:
    found = []
    waiting = [prim.GetPath() for prim in stage.GetPseudoRoot().GetFilteredChildren(_PREDICATE)]
    while waiting:
        path = waiting.pop(0)
        if stage.GetPrimAtPath(path).HasAuthoredPayloads():
            stage.Load(path, Usd.LoadWithoutDescendants)
        prim = stage.GetPrimAtPath(path)
        if SPECIMEN_API in prim.GetAppliedSchemas():
            found.append(path)
        else:
            waiting += [child.GetPath() for child in prim.GetFilteredChildren(_PREDICATE)]
    return found


def _require_no_instance(root: Usd.Prim) -> None:
    prim = root
    while prim and not prim.IsPseudoRoot():
        if prim.IsInstance():
            raise StageError(
                f"{prim.GetPath()}: is an instance, below which no tile can be loaded and no "
                "variant chosen, expected none: write instanceable = false on it in a layer over "
                f"{Path(prim.GetStage().GetRootLayer().realPath).name}"
            )
        prim = prim.GetParent()
