"""How a channel's surface is wrapped: the gaps that are bridged, the fragments that go.

The first paper's rule, from a channel's solids in all its tiles: fragments of less than half the
mean number of triangles, or half the mean diagonal, go; then alpha, the size of the gaps that are
bridged, follows from the means D and F of those that are kept. D / sqrt(F) is the length of a
triangle's side but for the shape, larger for plain bodies than for frayed ones; ALPHA_SIDES of it
are .6 um on nuclei in voxels of .28 x .14 x .14 um, .35 on membranes, .3 on vessels, 10.5 on a real
brain's cells in voxels of 5 x 2 x 2 um (the paper took 1 um). It stays between a coarsest spacing
and `surface.max_alpha_um`. An offset that is asked for is OFFSET_SHARE of alpha.

The rule sees no more of a fragment than a unit's halo: it holds for those up to a length that is
planned for, and larger ones stay.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.isosurface.components import find_components
from stereocell.isosurface.options import SurfaceOptions
from stereocell.isosurface.repair import RepairOptions
from stereocell.model.channel import SurfaceConfidence
from stereocell.model.settings import AUTO

SHARE = 0.5  # of the means: what is smaller goes
ALPHA_SIDES = 6.0
LEAST_ALPHA = 1.0  # coarsest spacings: nearer voxels have no gap between them
OFFSET_SHARE = 0.1  # of alpha, as the paper's 0.1 um of 1 um


@dataclass(frozen=True, slots=True)
class ComponentSums:
    """Sums over a tile's solids; of all, and of those that the rule keeps."""

    count: int
    faces: int
    diagonal_um: float
    kept: int
    kept_faces: int
    kept_diagonal_um: float


def sum_components(
    inside: NDArray[np.bool_], spacing_um: tuple[float, float, float], min_diagonal_um: float
) -> ComponentSums:
    """Return the sums over the solids of {field > iso-value} (z, y, x); specks are left out.

    They would rule the means: noise has more of them than a tile has bodies.
    """
    components = find_components(inside, spacing_um, 26)
    large = components.diagonal_um >= min_diagonal_um
    faces, diagonal = components.faces()[large], components.diagonal_um[large]
    if not len(faces):
        return ComponentSums(0, 0, 0.0, 0, 0, 0.0)
    kept = (faces >= SHARE * faces.mean()) & (diagonal >= SHARE * diagonal.mean())
    return ComponentSums(
        len(faces),
        int(faces.sum()),
        float(diagonal.sum()),
        int(kept.sum()),
        int(faces[kept].sum()),
        float(diagonal[kept].sum()),
    )


def choose_repair(
    tiles: Iterable[Mapping[str, Any]],
    most: RepairOptions,
    *,
    surface: SurfaceOptions,
    spacing_um: tuple[float, float, float],
    surface_confidence: SurfaceConfidence,
) -> RepairOptions:
    """Return what is cleaned of a channel's surface.

    tiles       ComponentSums of each, as plain values
    most        the most that may be cleaned: the units' halo covers it
    spacing_um  (z, y, x)

    No gaps are closed in a surface that is not clear, by either wrap: none is known to be one
    (building.plan.smoothed_plan).
    """
    sums = list(tiles)
    count, kept = (sum(tile[key] for tile in sums) for key in ("count", "kept"))
    options = most
    if count and most.max_fragment_um > 0:
        diagonal = SHARE * sum(tile["diagonal_um"] for tile in sums) / count
        options = replace(
            most,
            min_diagonal_um=max(most.min_diagonal_um, min(diagonal, most.max_fragment_um)),
            min_faces=SHARE * sum(tile["faces"] for tile in sums) / count,
        )
    if surface.alpha_um == AUTO:
        alpha = most.alpha_um
        if kept:
            diagonal = sum(tile["kept_diagonal_um"] for tile in sums) / kept
            faces = sum(tile["kept_faces"] for tile in sums) / kept
            alpha = ALPHA_SIDES * diagonal / faces**0.5
        least = LEAST_ALPHA * max(spacing_um)
        options = replace(options, alpha_um=min(max(alpha, least), most.alpha_um))
    if surface_confidence == "unclear":
        options = replace(options, alpha_um=0.0)
    wraps_triangles = surface.wrap == "alpha-wrap"  # which knows no offset of 0
    if surface.offset_um == AUTO or (wraps_triangles and not options.offset_um):
        options = replace(options, offset_um=OFFSET_SHARE * options.alpha_um)
    return options
