"""Find out whether a prim of a composed stage is drawn, and where it stands in the world."""

import numpy as np
from numpy.typing import NDArray
from pxr import Tf, Usd, UsdGeom, UsdUtils

from stereocell.model.errors import StageError
from stereocell.usd.read_attributes import require_still
from stereocell.usd.specimen import specimen_of
from stereocell.usd.typed_values import one_line

_PERSPECTIVE = 1e-9  # largest deviation of a matrix's last column from (0, 0, 0, 1)
_PURPOSES = (UsdGeom.Tokens.default_, UsdGeom.Tokens.render)  # purposes of prims in a final image
FARTHEST_UM = 1e12  # um, largest distance from the origin that float32 and browsers still draw


def require_composed(stage: Usd.Stage) -> None:
    """Raise StageError for the first layer, payload or reference that USD failed to compose."""
    errors = stage.GetCompositionErrors()
    if errors:
        raise StageError(
            f"{stage.GetRootLayer().realPath}: can't be composed, expected layers that USD can "
            f"open: {one_line(errors[0])}"
        )


def drawn(tile: Usd.Prim, path: object) -> Usd.Prim | None:
    """Return the prim at a path of a tile's stage; None where it is not drawn."""
    prim = tile.GetStage().GetPrimAtPath(path)
    return prim if prim and prim.IsActive() and is_visible(prim) else None


def is_visible(prim: Usd.Prim) -> bool:
    """Return whether a prim is drawn: not a guide or a proxy, and not hidden by any ancestor.

    A channel that is only off when the specimen opens counts as visible: a bundle includes it.
    """
    imageable = UsdGeom.Imageable(prim)
    if imageable.ComputePurpose() not in _PURPOSES:
        return False
    if imageable.ComputeVisibility() != UsdGeom.Tokens.invisible:
        return True
    above = map(prim.GetStage().GetPrimAtPath, prim.GetPath().GetAncestorsRange())
    return not any(map(_is_hidden, above))


def _is_hidden(prim: Usd.Prim) -> bool:
    """Return whether a prim is hidden for another reason than its channel's SHOWN prim."""
    visibility = UsdGeom.Imageable(prim).GetVisibilityAttr()
    if not visibility or visibility.Get() != UsdGeom.Tokens.invisible:
        return False
    stage, now = prim.GetStage(), Usd.TimeCode.Default()
    shown = stage.GetPrimAtPath(specimen_of(stage).shown.AppendChild(prim.GetName()))
    of_channel = UsdGeom.Imageable(shown).GetVisibilityAttr().GetPropertyStack(now) if shown else []
    return visibility.GetPropertyStack(now)[0] not in of_channel


def to_world(prim: Usd.Prim) -> NDArray[np.float64]:
    """Return the matrix (4, 4) from a prim's space to the world, for row vectors.

    Raises StageError if the matrix is singular or infinite, has a perspective, moves farther than
    FARTHEST_UM, or changes over time.
    """
    for path in prim.GetPath().GetAncestorsRange():
        for op in UsdGeom.Xformable(prim.GetStage().GetPrimAtPath(path)).GetOrderedXformOps():
            require_still(op.GetAttr())
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # USD would print the errors raised here
    try:
        matrix = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim))
    except Tf.ErrorException as error:
        raise StageError(
            f"{prim.GetPath()}: USD can't compute its transform, expected valid xformOps: "
            f"{one_line(error)}"
        ) from error
    finally:
        del quiet
    is_near = np.abs(matrix).max() <= FARTHEST_UM
    if not is_near or not np.abs(np.linalg.det(matrix[:3, :3])) > 0:
        raise StageError(
            f"{prim.GetPath()}: its transform is flat, infinite or moves farther than "
            f"{FARTHEST_UM:g} um, expected finite moves and scales other than 0: correct its "
            "xformOps"
        )
    if not np.allclose(matrix[:, 3], (0, 0, 0, 1), rtol=0, atol=_PERSPECTIVE):
        raise StageError(
            f"{prim.GetPath()}: the last column of its transform is "
            f"{', '.join(f'{part:g}' for part in matrix[:, 3])}, expected 0, 0, 0, 1: remove the "
            "perspective from its xformOps"
        )
    return matrix
