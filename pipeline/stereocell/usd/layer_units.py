"""Check that layers over a stage have the same units, up axis and default prim as the stage.

USD reads these fields from the opened layer and not from its sublayers. If the opened layer lacks
them, other programs interpret the numbers as centimetres.
"""

from collections.abc import Iterator
from pathlib import Path

from pxr import Sdf, Usd, UsdGeom

from stereocell.model.errors import StageError
from stereocell.usd.layer import METERS_PER_UNIT, UP_AXIS
from stereocell.usd.specimen import specimen_of
from stereocell.usd.written_files import DISPLAY_NAME, STAGE_NAME

_FALLBACK_UNIT = 0.01  # metres: USD's unit if a layer states none


def lines_for(stage: Usd.Stage) -> dict[str, str]:
    """Return the line to write into a layer over a stage for each field, by field name."""
    return {
        UsdGeom.Tokens.metersPerUnit: "metersPerUnit = 1e-6",
        UsdGeom.Tokens.upAxis: f'upAxis = "{UP_AXIS}"',
        "defaultPrim": f'defaultPrim = "{specimen_of(stage).top}"',
    }


def require_units(stage: Usd.Stage) -> None:
    """Raise StageError for a layer that states another unit, up axis or default prim.

    All sublayers are checked, also nested ones, since USD neither scales nor turns them. Layers of
    payloads are not checked. The default prim is checked in the root layer only, since other
    programs read it there.
    """
    lines, top = lines_for(stage), specimen_of(stage).top
    for layer in stage.GetLayerStack(includeSessionLayers=False):
        expected_prim = top if layer == stage.GetRootLayer() else ""
        for field, found, expected, effect in _wrong_fields(layer, expected_prim):
            raise StageError(
                f"{layer.realPath}: {field} is {found}, expected {expected}: write {lines[field]}, "
                f"because {effect}"
            )


def require_no_display(stage: Usd.Stage) -> None:
    """Raise StageError if the stage uses `display.usda` as a sublayer or a reference.

    That file is in metres and enlarges the stage, so its numbers do not fit those of a bundle.
    """
    for layer in stage.GetUsedLayers():
        path = Path(layer.realPath)
        if path.name == DISPLAY_NAME and path.with_name(STAGE_NAME).is_file():
            raise StageError(
                f"{stage.GetRootLayer().realPath}: lies over {path.name}, which is enlarged and in "
                f"metres, expected {STAGE_NAME}: put the edits into a layer over {STAGE_NAME}"
            )


def _wrong_fields(layer: Sdf.Layer, top: str) -> Iterator[tuple[str, str, str, str]]:
    """Yield the wrong fields of a layer: name, value, expected value and effect of the mistake.

    top  expected name of the default prim; empty: any name
    """
    root = layer.pseudoRoot
    unit, axis = UsdGeom.Tokens.metersPerUnit, UsdGeom.Tokens.upAxis
    if root.HasInfo(unit) and not UsdGeom.LinearUnitsAre(root.GetInfo(unit), METERS_PER_UNIT):
        effect = "the stage's numbers are in um and USD does not convert them"
        yield unit, f"{root.GetInfo(unit):g}", f"{METERS_PER_UNIT:g}", effect
    if root.HasInfo(axis) and root.GetInfo(axis) != UP_AXIS:
        yield axis, str(root.GetInfo(axis)), str(UP_AXIS), "USD does not turn a layer"
    if top and layer.defaultPrim and not _leads_to(str(layer.defaultPrim), top):
        effect = "other programs open only the default prim"
        yield "defaultPrim", str(layer.defaultPrim), top, effect


def _leads_to(default_prim: str, top: str) -> bool:
    return default_prim.removeprefix("/") == top


def note_missing(stage: Usd.Stage) -> str:
    """Return a message on the fields that a stage's root layer lacks; empty: it has them all."""
    layer, known = stage.GetRootLayer(), lines_for(stage)
    lacks = [field for field in known if not layer.pseudoRoot.HasInfo(field)]
    if not lacks:
        return ""
    effect = "may open it turned, or not find its specimen"
    if UsdGeom.Tokens.metersPerUnit in lacks:
        effect = f"open it {_FALLBACK_UNIT / METERS_PER_UNIT:.0f} times too large"
    lines = ", ".join(known[field] for field in lacks)
    return (
        f"{layer.realPath}: states no {', no '.join(lacks)}, so other programs {effect}: add a "
        f"line for each between the parentheses at the top of the layer: {lines}"
    )
