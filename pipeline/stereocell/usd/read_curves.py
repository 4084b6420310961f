"""Read basis curves of a composed stage as polylines with a width at each point.

Each span of a cubic curve is evaluated at SAMPLES_PER_SPAN points.

References
----------
OpenUSD, UsdGeomBasisCurves: basis matrices, and the vertices of each span.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, UsdGeom

from stereocell.model.errors import StageError
from stereocell.usd.typed_values import read_as

SAMPLES_PER_SPAN = 12
_WIDTH_SHARE = 0.01  # default width of curves, as a share of the longest edge of their box
# Basis matrices. Rows: powers of the parameter, highest first; columns: four vertices of a span
_BASES = {
    "bezier": [[-1, 3, -3, 1], [3, -6, 3, 0], [-3, 3, 0, 0], [1, 0, 0, 0]],
    "bspline": [[-1 / 6, 1 / 2, -1 / 2, 1 / 6], [1 / 2, -1, 1 / 2, 0], [-1 / 2, 0, 1 / 2, 0],
                [1 / 6, 2 / 3, 1 / 6, 0]],
    "catmullRom": [[-1 / 2, 3 / 2, -3 / 2, 1 / 2], [1, -5 / 2, 2, -1 / 2], [-1 / 2, 0, 1 / 2, 0],
                   [0, 1, 0, 0]],
}  # fmt: skip
_Types = Sdf.ValueTypeNames
Line = tuple[NDArray[np.float64], NDArray[np.float64]]  # points (n, 3), widths (n,)


def curve_lines(curves: UsdGeom.BasisCurves) -> Iterator[Line]:
    """Yield the points and widths of each curve, in the prim's own space.

    Raises StageError if the number of vertices or widths is wrong, or for an unknown basis.
    """
    path = curves.GetPath()
    points = np.array(read_as(curves.GetPointsAttr(), _Types.Point3fArray) or [], np.float64)
    counts = [int(n) for n in read_as(curves.GetCurveVertexCountsAttr(), _Types.IntArray) or ()]
    if sum(counts) != len(points) or any(count < 2 for count in counts):
        raise StageError(
            f"{path}.curveVertexCounts: found {counts!s:.60}, expected numbers of 2 or more whose "
            f"sum is {len(points)}, the number of points"
        )
    is_cubic = curves.GetTypeAttr().Get() == UsdGeom.Tokens.cubic
    basis = str(curves.GetBasisAttr().Get())
    is_closed = curves.GetWrapAttr().Get() == UsdGeom.Tokens.periodic
    if is_cubic and basis not in _BASES:
        raise StageError(f"{path}.basis: found {basis!r}, expected one of {', '.join(_BASES)}")
    widths = _widths(curves, points)
    start = 0
    for count in counts:
        own = slice(start, start + count)
        values = np.column_stack([points[own], widths[own]])
        if is_closed:
            values = np.concatenate([values, values[: 3 if is_cubic else 1]])
        line = _evaluate(values, basis, str(path)) if is_cubic else values
        yield line[:, :3], line[:, 3]
        start += count


def _widths(curves: UsdGeom.BasisCurves, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the width at each vertex. A single stated width, or the default, holds for all."""
    given = np.array(read_as(curves.GetWidthsAttr(), _Types.FloatArray) or [], np.float64)
    if len(given) == len(points):
        return given
    if len(given) > 1:
        raise StageError(
            f"{curves.GetPath()}.widths: found {len(given)} numbers, expected 1 or {len(points)}"
        )
    usual = _WIDTH_SHARE * float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    return np.full(len(points), given[0] if len(given) else usual)


def _evaluate(values: NDArray[np.float64], basis: str, path: str) -> NDArray[np.float64]:
    """Return points along the spans of a cubic curve, including both ends."""
    step = 3 if basis == "bezier" else 1
    if len(values) < 4 or (len(values) - 4) % step:
        expected = "4 or more" if step == 1 else "4, 7, 10, ..."
        raise StageError(
            f"{path}: found {len(values)} vertices, expected {expected} for a {basis} curve"
        )
    along = np.linspace(0, 1, SAMPLES_PER_SPAN, endpoint=False)
    powers = np.stack([along**3, along**2, along, np.ones_like(along)], axis=1)
    matrix = np.array(_BASES[basis])
    starts = range(0, len(values) - 3, step)
    spans = [powers @ matrix @ values[start : start + 4] for start in starts]
    last = matrix.sum(axis=0) @ values[starts[-1] : starts[-1] + 4]
    return np.concatenate([*spans, last[np.newaxis]])
