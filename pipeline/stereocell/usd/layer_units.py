"""Hold the units, the up axis and the default prim of the layers over a stage against the stage's.

USD takes them from the layer that is opened, and never from its sublayers. Without them, other
programs take the numbers for centimetres.
"""

from collections.abc import Iterator
from pathlib import Path

from pxr import Sdf, Usd, UsdGeom

from stereocell.model.errors import StageError
from stereocell.usd.layer import METERS_PER_UNIT, UP_AXIS
from stereocell.usd.specimen import specimen_of
from stereocell.usd.written_files import DISPLAY_NAME, STAGE_NAME

_FALLBACK_UNIT = 0.01  # metres: USD's unit where a layer states none


def lines_for(stage: Usd.Stage) -> dict[str, str]:
    """Return the line that states each field of a layer over a stage, by the field."""
    return {
        UsdGeom.Tokens.metersPerUnit: "metersPerUnit = 1e-6",
        UsdGeom.Tokens.upAxis: f'upAxis = "{UP_AXIS}"',
        "defaultPrim": f'defaultPrim = "{specimen_of(stage).top}"',
    }


def require_units(stage: Usd.Stage) -> None:
    """Raise StageError for a layer that states another unit, up axis or default prim.

    Every layer of the stack counts, sublayers of sublayers too: USD rescales and turns none. A
    payload's layer is not looked at. The default prim is that of the stage's root layer alone:
    other programs open no other.
    """
    lines, top = lines_for(stage), specimen_of(stage).top
    for layer in stage.GetLayerStack(includeSessionLayers=False):
        expected_prim = top if layer == stage.GetRootLayer() else ""
        for field, found, expected, effect in _wrong_fields(layer, expected_prim):
            raise StageError(
                f"{layer.realPath}: {field} is {found}, expected {expected}: write {lines[field]} "
                f"there; {effect}"
            )


def require_no_display(stage: Usd.Stage) -> None:
    """Raise StageError where a layer lies over `display.usda`, or a scene references it.

    That file is in metres and enlarges the stage, so none of its numbers are those of a bundle.
    """
    for layer in stage.GetUsedLayers():
        path = Path(layer.realPath)
        if path.name == DISPLAY_NAME and path.with_name(STAGE_NAME).is_file():
            raise StageError(
                f"{stage.GetRootLayer().realPath}: lies over {path.name}, which shows the stage "
                f"enlarged and in metres, expected {STAGE_NAME}: put the edits into a layer over "
                "that one"
            )


def _wrong_fields(layer: Sdf.Layer, top: str) -> Iterator[tuple[str, str, str, str]]:
    """Yield the fields that a layer states wrongly: name, value, expected value, effect.

    top  name of the default prim; empty: any
    """
    root = layer.pseudoRoot
    unit, axis = UsdGeom.Tokens.metersPerUnit, UsdGeom.Tokens.upAxis
    if root.HasInfo(unit) and not UsdGeom.LinearUnitsAre(root.GetInfo(unit), METERS_PER_UNIT):
        effect = "this scales nothing, a stage's numbers are um"
        yield unit, f"{root.GetInfo(unit):g}", f"{METERS_PER_UNIT:g}", effect
    if root.HasInfo(axis) and root.GetInfo(axis) != UP_AXIS:
        yield axis, str(root.GetInfo(axis)), str(UP_AXIS), "this turns nothing"
    if top and layer.defaultPrim and not _leads_to(str(layer.defaultPrim), top):
        effect = "other programs open that prim alone"
        yield "defaultPrim", str(layer.defaultPrim), top, effect


def _leads_to(default_prim: str, top: str) -> bool:
    return default_prim.removeprefix("/") == top


def note_missing(stage: Usd.Stage) -> str:
    """Return a line on the fields that a stage's root layer lacks; empty: it states them all."""
    layer, known = stage.GetRootLayer(), lines_for(stage)
    lacks = [field for field in known if not layer.pseudoRoot.HasInfo(field)]
    if not lacks:
        return ""
    effect = "may open it turned, or not find its specimen"
    if UsdGeom.Tokens.metersPerUnit in lacks:
        effect = f"open it {_FALLBACK_UNIT / METERS_PER_UNIT:.0f} times too large"
    lines = ", ".join(known[field] for field in lacks)
    return (
        f"{layer.realPath}: states no {', no '.join(lacks)}, so other programs {effect}: write "
        f"each on a line of its own between the parentheses at the top of the layer: {lines}"
    )
