"""Clean a solid before its surface is extracted: drop fragments, close gaps, fill cavities.

All three steps work on the signed distance of a window (tile + halo). Neighbouring tiles must
decide alike on a component near their common plane. So only components that lie wholly inside the
window are dropped or filled, and only up to a size that the halo covers (`reach_um`). A tile that
sees part of such a component near the plane then sees all of it.

Gaps are closed on voxels, by a ball of radius alpha. Alpha is the size of the gaps that are
bridged, and offset is the distance of the surface from the solid, as in an alpha wrap of triangles.
Working on voxels takes a fraction of its time.

References
C. Portaneri, M. Rouxel-Labbe, M. Hemmer, D. Cohen-Steiner & P. Alliez, "Alpha wrapping with an
offset", ACM Trans. Graphics 41(4), 2022. doi:10.1145/3528223.3530152
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.filters.boxes import dilate
from stereocell.isosurface.components import find_components
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.kernels.closing import close_gaps
from stereocell.model.spacing import Spacing

Distance = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Repaired:
    """The cleaned distance, float32 (z, y, x) in um, positive inside, and the number of changes."""

    distance: Distance
    fragments_dropped: int
    cavities_filled: int


def repair(distance: Distance, spacing_um: Spacing, *, options: RepairOptions) -> Repaired:
    """Clean a signed distance, in place.

    distance    float32 (z, y, x), um, positive inside
    spacing_um  (z, y, x)

    >>> z, y, x = np.ogrid[-12:12, -12:12, -12:12]
    >>> ball = np.clip(6 - np.sqrt(z**2 + y**2 + x**2), -2, 2).astype(np.float32)
    >>> ball[2, 2, 2], ball[12, 12, 12] = 1, -1  # a speck outside, and a hole inside
    >>> options = RepairOptions(alpha_um=0, min_diagonal_um=4, max_cavity_um=4)
    >>> found = repair(ball, (1.0, 1.0, 1.0), options=options)
    >>> found.fragments_dropped, found.cavities_filled, bool(ball[2, 2, 2] < 0 < ball[12, 12, 12])
    (1, 1, True)
    """
    dropped = _drop_fragments(distance, spacing_um, options)
    if options.offset_um > 0:
        limit = np.float32(2 * max(spacing_um))
        distance += np.float32(options.offset_um)
        np.clip(distance, -limit, limit, out=distance)
    if options.alpha_um > 0:
        _close(distance, spacing_um, options.alpha_um)
    filled = _fill_cavities(distance, spacing_um, options.max_cavity_um)
    return Repaired(distance, dropped, filled)


def _drop_fragments(distance: Distance, spacing_um: Spacing, options: RepairOptions) -> int:
    """Set small solids inside the window to far outside, and return their number."""
    # Connectivity 26: a fragment that touches a neighbour by a corner belongs to the neighbour.
    components = find_components(distance > 0, spacing_um, 26)
    small = components.diagonal_um < options.min_diagonal_um
    doubtful = ~small & (components.diagonal_um < options.max_fragment_um)
    if options.min_faces > 0 and doubtful.any():
        small |= doubtful & (components.faces() < options.min_faces)
    small &= components.whole
    if not small.any():
        return 0
    gone = components.mask_of(small)
    if options.offset_um > 0:
        # Just outside a fragment the distance is barely negative, and the offset would restore it.
        gone |= dilate(gone, (1, 1, 1)) & ~dilate(components.mask_of(~small), (1, 1, 1))
    np.copyto(distance, np.float32(-2 * max(spacing_um)), where=gone)
    return int(small.sum())


def _fill_cavities(distance: Distance, spacing_um: Spacing, max_diagonal_um: float) -> int:
    """Set small cavities to far inside, and return their number.

    A cavity is a hole that no path connects to the outside.
    """
    holes = find_components(distance <= 0, spacing_um, 6)
    small = holes.whole & (holes.diagonal_um < max_diagonal_um)
    if small.any():
        np.copyto(distance, np.float32(2 * max(spacing_um)), where=holes.mask_of(small))
    return int(small.sum())


def _close(distance: Distance, spacing_um: Spacing, alpha_um: float) -> None:
    """Add to the solid the voxels that a ball of radius alpha cannot reach from outside.

    The added part lies one voxel below the surface, so smooth parts of the surface do not move.
    """
    close_gaps(distance, np.array(spacing_um, np.float64), alpha_um, float(max(spacing_um)))
