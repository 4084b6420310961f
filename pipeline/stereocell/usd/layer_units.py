"""Find the units, the up axis and the default prim that a layer over a stage does not state.

USD takes them from the layer that is opened, and never from its sublayers. Without them, other
programs take the numbers for centimetres.
"""

from pxr import Usd, UsdGeom

from stereocell.usd.layer import METERS_PER_UNIT, ROOT, UP_AXIS

_FALLBACK_UNIT = 0.01  # metres: USD's unit where a layer states none
STATED_UNIT = "metersPerUnit = 1e-6"
STATED_AXIS = f'upAxis = "{UP_AXIS}"'
# field of a layer -> the line that states it
LINES = {
    UsdGeom.Tokens.metersPerUnit: STATED_UNIT,
    UsdGeom.Tokens.upAxis: STATED_AXIS,
    "defaultPrim": f'defaultPrim = "{ROOT.name}"',
}


def note_missing(stage: Usd.Stage) -> str:
    """Return a line on the fields that a stage's root layer lacks; empty: it states them all."""
    layer = stage.GetRootLayer()
    lacks = [field for field in LINES if not layer.pseudoRoot.HasInfo(field)]
    if not lacks:
        return ""
    effect = "may open it turned, or not find its specimen"
    if UsdGeom.Tokens.metersPerUnit in lacks:
        effect = f"open it {_FALLBACK_UNIT / METERS_PER_UNIT:.0f} times too large"
    lines = ", ".join(LINES[field] for field in lacks)
    return (
        f"{layer.realPath}: states no {', no '.join(lacks)}, so other programs {effect}: write "
        f"each on a line of its own between the parentheses at the top of the layer: {lines}"
    )
