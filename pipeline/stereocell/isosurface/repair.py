"""Make a solid clean before its surface is extracted: fragments out, gaps closed, cavities filled.

All three work on the signed distance of a window (tile + halo). A verdict on a component may
differ between neighbouring tiles only if they see different parts of it; hence only components
that lie wholly inside the window are dropped or filled, and only up to a size that the halo
covers (`reach_um`): whoever sees such a component near a common plane sees all of it.

Closing is done on voxels, by a ball of radius alpha, and keeps the paper's meaning of alpha (the
size of the gaps that are bridged) and of offset (how far outside the surface lies) at a fraction
of the time of an alpha wrap over triangles (Portaneri et al. 2022).
"""

from dataclasses import dataclass

import edt
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.isosurface.components import find_components

Distance = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class RepairOptions:
    """What is cleaned, lengths in um.

    alpha_um         radius of the ball that closes gaps; 0: none are closed
    min_diagonal_um  fragments of a smaller diagonal go
    max_cavity_um    cavities of a smaller diagonal are filled
    min_faces        fragments of fewer triangles go as well,
    max_fragment_um  if their diagonal is under this
    offset_um        how far the surface moves outward; at most a voxel, beyond which the field's
                     distance means nothing
    """

    alpha_um: float
    min_diagonal_um: float
    max_cavity_um: float
    min_faces: float = 0.0
    max_fragment_um: float = 0.0
    offset_um: float = 0.0

    def reach_um(self, spacing_um: tuple[float, float, float]) -> float:
        """Return how far from a voxel lies what decides on it: the halo must cover it."""
        closing = 2 * self.alpha_um + 2 * max(spacing_um) if self.alpha_um > 0 else 0.0
        fragment = max(self.min_diagonal_um, self.max_fragment_um)
        return closing + fragment + self.max_cavity_um + 2 * max(spacing_um)


@dataclass(frozen=True, slots=True)
class Repaired:
    """`distance` (z, y, x) um, positive inside, and what was done to it."""

    distance: Distance
    fragments_dropped: int
    cavities_filled: int


def repair(
    distance: Distance, spacing_um: tuple[float, float, float], options: RepairOptions
) -> Repaired:
    """Return the cleaned signed distance; the argument stays as it is, and is what comes back where
    nothing was to be cleaned.
    """
    distance, dropped = _drop_fragments(distance, spacing_um, options)
    if options.offset_um > 0:
        limit = np.float32(2 * max(spacing_um))
        distance = distance + np.float32(options.offset_um)
        np.clip(distance, -limit, limit, out=distance)
    if options.alpha_um > 0:
        distance = _close(distance, spacing_um, options.alpha_um)
    distance, filled = _fill_cavities(distance, spacing_um, options.max_cavity_um)
    return Repaired(distance, dropped, filled)


def _drop_fragments(
    distance: Distance, spacing_um: tuple[float, float, float], options: RepairOptions
) -> tuple[Distance, int]:
    """Return the distance with small solids inside the window set far outside, and how many."""
    # 26-connected: a fragment joined by a corner belongs to its neighbour
    components = find_components(distance > 0, spacing_um, 26)
    small = components.diagonal_um < options.min_diagonal_um
    doubtful = ~small & (components.diagonal_um < options.max_fragment_um)
    if options.min_faces > 0 and doubtful.any():
        small |= doubtful & (components.faces() < options.min_faces)
    small &= components.whole
    if not small.any():
        return distance, 0
    outside = np.float32(-2 * max(spacing_um))
    gone = np.concatenate([[False], small])[components.labels]
    if options.offset_um > 0:
        # just outside a fragment the distance is hardly negative: the offset would bring it back
        near = ndimage.maximum_filter(gone.view(np.uint8), 3, mode="constant")
        kept = ((components.labels > 0) & ~gone).view(np.uint8)
        near &= ~ndimage.maximum_filter(kept, 3, mode="constant") & 1
        gone |= near.view(bool)
    return np.where(gone, outside, distance), int(small.sum())


def _fill_cavities(
    distance: Distance, spacing_um: tuple[float, float, float], max_diagonal_um: float
) -> tuple[Distance, int]:
    """Return the distance with small holes that no path joins to the outside set far inside, and
    how many.
    """
    holes = find_components(distance <= 0, spacing_um, 6)
    small = holes.whole & (holes.diagonal_um < max_diagonal_um)
    if not small.any():
        return distance, 0
    gone = np.concatenate([[False], small])[holes.labels]
    return np.where(gone, np.float32(2 * max(spacing_um)), distance), int(small.sum())


def _close(distance: Distance, spacing_um: tuple[float, float, float], alpha_um: float) -> Distance:
    """Add to the solid what a ball of radius alpha, rolling outside, cannot reach.

    The joint lies one voxel inside, so that smooth parts of the surface stay where they are. It is
    done on the whole window: in boxes round the solids, with the margins that they need, it took
    .75 to 1.2 of the time on nuclei, membranes, vessels and the cells of a real brain.
    """
    h = float(max(spacing_um))
    margin = [int(np.ceil(alpha_um / step)) + 1 for step in spacing_um]
    mask = np.pad(distance <= 0, [(m, m) for m in margin], constant_values=True)
    # no centres of balls that fit outside, then how far each voxel is from the nearest that is one
    mask = edt.edt(mask, anisotropy=spacing_um, parallel=1) < alpha_um
    away = edt.edt(mask, anisotropy=spacing_um, parallel=1)
    away = away[tuple(slice(m, -m) for m in margin)]
    away -= np.float32(alpha_um + h)
    np.clip(away, -2 * h, h, out=away)
    return np.maximum(distance, away)
