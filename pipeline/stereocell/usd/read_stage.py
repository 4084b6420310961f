"""Open a composed stage, with all layers that an artist put over it, and load its tiles.

USD composes all values: colours, visibility, moved tiles, selected variants. The surfaces and
volumes of a loaded tile are read by read_levels.py and read_volume.py.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Tf, Usd, UsdGeom, UsdUtils

from stereocell.model.errors import StageError
from stereocell.model.world_box import move_box
from stereocell.storage.workspace import cached
from stereocell.usd.drawn_prims import FARTHEST_UM, is_visible, require_composed, to_world
from stereocell.usd.layer import OPENING_CUT, PATIENT_API, SIDES, SURFACE_API
from stereocell.usd.layer_units import require_no_display, require_units
from stereocell.usd.read_attributes import (
    Point,
    numbers_of,
    point_of,
    select_variant,
)
from stereocell.usd.read_variants import TileChoice, read_choice
from stereocell.usd.specimen import find_specimen, specimen_of
from stereocell.usd.typed_values import one_line, read_as, text_of
from stereocell.usd.written_files import STAGE_NAME, AsWritten

_SIDE_DIGITS = 9  # decimals of unit vectors to a patient's sides: more than scanners state
_Types = Sdf.ValueTypeNames


def open_stage(path: Path) -> Usd.Stage:
    """Open a stage without its payloads.

    Raises StageError if the file is not a StereoCell stage or a layer over one, or if a layer has
    other units, another up axis or another default prim.
    """
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # keeps USD from printing the errors, too
    try:
        stage = Usd.Stage.Open(str(path), Usd.Stage.LoadNone)
    except Tf.ErrorException as error:
        raise StageError(
            f"{path}: can't be opened, expected a USD layer (.usda, .usdc, .usd, .usdz): "
            f"{one_line(error)}"
        ) from error
    finally:
        del quiet
    specimen = find_specimen(stage)
    require_composed(stage)
    if stage.GetPrimAtPath(specimen.channels):
        require_no_display(stage)
        require_units(stage)
    for needed in (specimen.root, specimen.channels, specimen.tiles):
        if not stage.GetPrimAtPath(needed):
            raise StageError(
                f"{path}: found no prim {needed}, expected the {STAGE_NAME} of a build, or a layer "
                f"over it: add {STAGE_NAME} to its sublayers"
            )
    _require_places(stage)
    return stage


def _require_places(stage: Usd.Stage) -> None:
    """Raise StageError if a layer moves prims of the build to another path by `relocates`."""
    root = specimen_of(stage).root
    for layer in stage.GetLayerStack(includeSessionLayers=False):
        for old, new in layer.relocates:
            if old != root and (old.HasPrefix(root) or new.HasPrefix(root)):
                raise StageError(
                    f"{layer.realPath}: relocates {old} to {new or 'nothing'}, expected the paths "
                    "of the build: set a display name instead, or deactivate the prim"
                )


def specimen_name(stage: Usd.Stage) -> str:
    """Return the specimen's display name, or else its prim's name."""
    root = stage.GetPrimAtPath(specimen_of(stage).root)
    return str(root.GetDisplayName() or root.GetName())


def modality_of(stage: Usd.Stage) -> str:
    """Return DICOM's code of the modality, such as `MR`; empty: the stage states none."""
    return text_of(stage.GetPrimAtPath(specimen_of(stage).root).GetAttribute("stereocell:modality"))


def sides_of(stage: Usd.Stage) -> dict[str, Point] | None:
    """Return unit vectors (x, y, z) to the patient's sides, world; None: the stage states none.

    The vectors turn and mirror with the tiles' group. Raises StageError for a vector without a
    length.
    """
    group = stage.GetPrimAtPath(specimen_of(stage).tiles)
    if PATIENT_API not in group.GetAppliedSchemas():
        return None
    turn = to_world(group)[:3, :3]
    sides = {}
    for side, name in SIDES.items():
        along = np.array(point_of(group, name)) @ turn
        length = np.linalg.norm(along)
        if not length > 0:
            raise StageError(
                f"{group.GetPath()}.{name}: found a vector of length 0, expected a direction"
            )
        x, y, z = (float(part) for part in np.round(along / length, _SIDE_DIGITS) + 0.0)
        sides[side] = (x, y, z)
    return sides


def opening_cut_of(stage: Usd.Stage) -> tuple[Point, float] | None:
    """Return the clip plane that is active at opening; None: the specimen opens whole.

    The plane is a unit normal (x, y, z), which points to the part that is cut away, and an offset
    in um, both in the world. Raises StageError for a normal without a length, or a distant plane.
    """
    root = stage.GetPrimAtPath(specimen_of(stage).root)
    if root.GetAttribute(OPENING_CUT).Get() is None:
        return None
    *normal, offset = numbers_of(root, OPENING_CUT, 4)
    length = float(np.linalg.norm(normal))
    if not 0 < length < FARTHEST_UM or not abs(offset) < FARTHEST_UM * length:
        raise StageError(
            f"{root.GetPath()}.{OPENING_CUT}: found {normal}, {offset:g}, expected the normal of a "
            "plane and its offset in um"
        )
    x, y, z = (float(part) for part in np.round(np.array(normal) / length, _SIDE_DIGITS) + 0.0)
    return (x, y, z), offset / length


def tile_prims(stage: Usd.Stage) -> list[Usd.Prim]:
    """Return the tiles that are active and visible, loaded or not, in the stage's order."""
    kept = Usd.PrimIsActive & Usd.PrimIsDefined & ~Usd.PrimIsAbstract
    prims = stage.GetPrimAtPath(specimen_of(stage).tiles).GetFilteredChildren(kept)
    return [prim for prim in prims if is_visible(prim)]


def hinted_box(tile: Usd.Prim) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower and upper corner (x, y, z), world um, of a tile's extentsHint.

    The tile need not be loaded. Raises StageError if the hint is missing or invalid.
    """
    attribute = UsdGeom.ModelAPI(tile).GetExtentsHintAttr()
    hint = read_as(attribute, _Types.Float3Array, may_be_nan=True)
    if not hint:
        raise StageError(f"{tile.GetPath()}.extentsHint: found no value, expected two corners")
    corners = np.array(hint, np.float64)
    if len(corners) < 2 or not np.abs(corners).max() <= FARTHEST_UM:
        raise StageError(
            f"{tile.GetPath()}.extentsHint: found {hint!s:.60}, expected two corners within "
            f"{FARTHEST_UM:g} um"
        )
    return move_box(corners[0], corners[1], to_world(tile))


@contextmanager
def loaded(
    stage: Usd.Stage, tile_id: str, *, as_written: AsWritten | None = None
) -> Iterator[tuple[Usd.Prim, TileChoice]]:
    """Yield a tile's prim with its payload loaded, and its selected variants.

    as_written  the lists to compare the tile's files with; None: no comparison

    Both meshes and volumes are active, whichever representation is selected. Raises StageError if
    the payload can't be composed, or if a layer is missing or damaged.
    """
    path = specimen_of(stage).tiles.AppendChild(tile_id)
    with cached(Path(stage.GetRootLayer().realPath).parent / "tiles" / tile_id):
        if as_written is not None:
            for folder in _stage_folders(stage):
                as_written.require_layers(folder / "tiles" / tile_id)
        yield from _loaded(stage, path)


def _require_names(tile: Usd.Prim) -> None:
    """Raise StageError for a surface that readers can't find because a prim was renamed.

    Surfaces are recognized by their API schema. Surfaces of an inactive channel are not checked.
    """
    stage = tile.GetStage()
    channels = specimen_of(stage).channels
    for branch in tile.GetChildren():
        expected = f"{branch.GetName()}_{tile.GetName()}"
        has_channel = bool(stage.GetPrimAtPath(channels.AppendChild(branch.GetName())))
        if has_channel and branch.GetChild(expected):
            continue
        for mesh in branch.GetChildren():
            if SURFACE_API in mesh.GetAppliedSchemas():
                raise StageError(
                    f"{mesh.GetPath()}: found a renamed tile, channel or mesh, expected "
                    f"{tile.GetPath()}/CHANNEL/CHANNEL_{tile.GetName()} with a channel of "
                    f"{channels}: undo the renaming, and set display names instead"
                )


def _stage_folders(stage: Usd.Stage) -> list[Path]:
    """Return the folders of a stage's layers, without those of payloads that are not loaded."""
    paths = [layer.realPath for layer in stage.GetUsedLayers() if layer.realPath]
    return sorted({Path(path).parent for path in paths})


def _loaded(stage: Usd.Stage, path: Sdf.Path) -> Iterator[tuple[Usd.Prim, TileChoice]]:
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # `require_composed` reports USD's errors
    stage.Load(path)
    del quiet
    try:
        require_composed(stage)
        prim = stage.GetPrimAtPath(path)
        choice = read_choice(prim)
        if "both" in prim.GetVariantSet("representation").GetVariantNames():
            select_variant(prim, "representation", "both")
        _require_names(prim)
        yield prim, choice
    finally:
        stage.Unload(path)
        # `select_variant` selected variants of the loaded tile here. They no longer apply.
        if (selected := stage.GetSessionLayer().GetPrimAtPath(path)) is not None:
            selected.variantSelections.clear()
