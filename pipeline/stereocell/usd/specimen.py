"""Find the prim of the specimen in a composed stage.

A build writes it at /Specimen. A scene may reference the stage at any path. Then `find_specimen`
searches for the one prim with the specimen's API schema. It stores the path in the session layer of
the opened stage, where all readers look it up.
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
# Active and defined prims, including those of instances
_PREDICATE = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract)


@dataclass(frozen=True, slots=True)
class Specimen:
    """The paths of a specimen's prims in a composed stage."""

    root: Sdf.Path = ROOT

    def _moved(self, built: Sdf.Path) -> Sdf.Path:
        return built.ReplacePrefix(ROOT, self.root)

    @property
    def channels(self) -> Sdf.Path:
        """The path of the prim above the channels' materials."""
        return self._moved(CHANNELS)

    @property
    def shown(self) -> Sdf.Path:
        """The path of the prim above one prim for each channel.

        By USD's `inherits`, all surfaces and volumes of a channel take their visibility from it.
        """
        return self._moved(SHOWN)

    @property
    def classes(self) -> Sdf.Path:
        """The path of the prim above the materials for classes of objects."""
        return self._moved(CLASSES)

    @property
    def tiles(self) -> Sdf.Path:
        """The path of the prim above the tiles."""
        return self._moved(TILES)

    @property
    def cameras(self) -> Sdf.Path:
        """The path of the prim above the build's cameras."""
        return self._moved(CAMERAS)

    @property
    def lights(self) -> Sdf.Path:
        """The path of the prim above the build's lights."""
        return self._moved(LIGHTS)

    @property
    def top(self) -> str:
        """The name of the root prim that is the specimen or contains it."""
        return str(self.root.GetPrefixes()[0].name)


def specimen_of(stage: Usd.Stage) -> Specimen:
    """Return the specimen of a stage that was opened by `open_stage`."""
    kept = stage.GetSessionLayer().customLayerData.get(_KEY)
    return Specimen(Sdf.Path(kept)) if kept else Specimen()


def find_specimen(stage: Usd.Stage) -> Specimen:
    """Find the specimen of a stage, and store its path for `specimen_of`.

    Payloads that contain it are loaded. Raises StageError if there are several specimens, or if it
    is part of an instance, since tiles in instances can't be loaded one by one.
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
                f"{prim.GetPath()}: found an instance, whose tiles and variants USD can't select, "
                "expected a plain prim: set its instanceable to false in a layer over "
                f"{Path(prim.GetStage().GetRootLayer().realPath).name}"
            )
        prim = prim.GetParent()
