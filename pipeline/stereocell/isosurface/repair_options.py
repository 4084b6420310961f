"""Options of `repair`. Plans hold them without the repair, whose library is slow to import."""

from dataclasses import dataclass

from stereocell.model.spacing import Spacing


@dataclass(frozen=True, slots=True)
class RepairOptions:
    """How a solid is cleaned. Lengths are in um.

    alpha_um         radius of the ball that closes gaps; 0: gaps stay open
    min_diagonal_um  fragments with a smaller diagonal are dropped
    max_cavity_um    cavities with a smaller diagonal are filled
    min_faces        fragments with fewer triangles, and a diagonal below max_fragment_um, are
                     dropped too
    max_fragment_um  see min_faces; larger fragments stay, however few triangles they have
    offset_um        distance by which the surface moves outward; at most a voxel, because the field
                     is not a distance farther away
    """

    alpha_um: float
    min_diagonal_um: float
    max_cavity_um: float
    min_faces: float = 0.0
    max_fragment_um: float = 0.0
    offset_um: float = 0.0

    def reach_um(self, spacing_um: Spacing) -> float:
        """Return the distance in um on which a voxel's result depends; the halo must cover it."""
        closing = 2 * self.alpha_um + 2 * max(spacing_um) if self.alpha_um > 0 else 0.0
        fragment = max(self.min_diagonal_um, self.max_fragment_um)
        return closing + fragment + self.max_cavity_um + 2 * max(spacing_um)
