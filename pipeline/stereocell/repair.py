"""Make a solid clean before its surface is extracted: fragments out, gaps closed, cavities filled.

All three work on the signed distance of a window (tile + halo). A verdict on a component may
differ between neighbouring tiles only if they see different parts of it; hence only components
that lie wholly inside the window are dropped or filled, and only up to a size that the halo
covers (`reach_um`): whoever sees such a component near a common plane sees all of it.

Closing is done on voxels, by a ball of radius alpha, and keeps the paper's meaning of alpha (the
size of the gaps that are bridged) at a fraction of the time of an alpha wrap over triangles
(Portaneri et al. 2022).
"""

from dataclasses import dataclass
from typing import Literal

import cc3d
import edt
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class RepairOptions:
    """Lengths in um."""

    alpha_um: float
    min_diagonal_um: float
    max_cavity_um: float

    def reach_um(self, spacing_um: tuple[float, float, float]) -> float:
        """Return how far from a voxel lies what decides on it: the halo must cover it."""
        closing = 2 * self.alpha_um + 2 * max(spacing_um) if self.alpha_um > 0 else 0.0
        return closing + self.min_diagonal_um + self.max_cavity_um + 2 * max(spacing_um)


@dataclass(frozen=True, slots=True)
class Repaired:
    """`distance` (z, y, x) um, positive inside, and what was done to it."""

    distance: NDArray[np.float32]
    fragments_dropped: int
    cavities_filled: int


def repair(
    distance: NDArray[np.float32], spacing_um: tuple[float, float, float], options: RepairOptions
) -> Repaired:
    """Return the cleaned signed distance; the argument stays as it is."""
    distance = distance.copy()
    outside = np.float32(-2 * max(spacing_um))
    # 26-connected solids: a fragment joined by a corner belongs to its neighbour
    dropped = _replace_small(
        distance, distance > 0, 26, spacing_um, options.min_diagonal_um, outside
    )
    if options.alpha_um > 0:
        distance = _close(distance, spacing_um, options.alpha_um)
    filled = _replace_small(distance, distance <= 0, 6, spacing_um, options.max_cavity_um, -outside)
    return Repaired(distance, dropped, filled)


def _replace_small(
    distance: NDArray[np.float32],
    mask: NDArray[np.bool_],
    connectivity: Literal[6, 26],
    spacing_um: tuple[float, float, float],
    max_diagonal_um: float,
    value: np.float32,
) -> int:
    """Set the mask's small components that lie inside the window to `value`; return how many."""
    labels = cc3d.connected_components(mask, connectivity=connectivity)
    found = cc3d.statistics(labels, no_slice_conversion=True)["bounding_boxes"]
    boxes = np.asarray(found, np.int64).reshape(-1, 3, 2)[1:]  # (label, axis, first and last)
    if not len(boxes):
        return 0
    diagonal = np.linalg.norm((boxes[:, :, 1] - boxes[:, :, 0]) * np.asarray(spacing_um), axis=1)
    end = np.asarray(mask.shape) - 1
    whole = ((boxes[:, :, 0] > 0) & (boxes[:, :, 1] < end)).all(axis=1)
    small = np.concatenate([[False], whole & (diagonal < max_diagonal_um)])
    if small.any():
        distance[small[labels]] = value
    return int(small.sum())


def _close(
    distance: NDArray[np.float32], spacing_um: tuple[float, float, float], alpha_um: float
) -> NDArray[np.float32]:
    """Add to the solid what a ball of radius alpha, rolling outside, cannot reach.

    The joint lies one voxel inside, so that smooth parts of the surface stay where they are.
    """
    h = float(max(spacing_um))
    margin = [int(np.ceil(alpha_um / step)) + 1 for step in spacing_um]
    outside = np.pad(distance <= 0, [(m, m) for m in margin], constant_values=True)
    # centres of balls that fit outside, then how far each voxel is from the nearest of them
    centres = edt.edt(outside, anisotropy=spacing_um, parallel=1) >= alpha_um
    away = edt.edt(~centres, anisotropy=spacing_um, parallel=1)
    away = away[tuple(slice(m, -m) for m in margin)]
    return np.maximum(distance, np.clip(away - np.float32(alpha_um + h), -2 * h, h))
