"""The step that sums up the connected components of one (tile, channel) at its level."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np

from stereocell.engine.step import Document, Step
from stereocell.filters.denoise import denoise
from stereocell.isosurface.repair_rules import sum_components
from stereocell.model.lattice import Step as PlaneStep
from stereocell.model.lattice_field import LatticeField
from stereocell.model.tiling import Box
from stereocell.steps.open_source import Voxels
from stereocell.steps.units_again import AGAIN

Sums = Mapping[str, Any]  # the fields of `ComponentSums`


@dataclass(frozen=True, slots=True)
class SumComponents(Step[Sums]):
    """Sum up the components of one tile of a channel.

    iso              level of the tile above the background, voxel values
    background       background near the tile, voxel values; None: none is subtracted
    min_diagonal_um  smaller components are left out, um
    max_shift        most that smoothing may move a value, in voxel values; None: no bound
    step             voxels (z, y, x) between the planes from which the surface is extracted
    higher           higher level with which `iso` is compared, in the same values; None: none
    """

    VERSION: ClassVar[int] = 1
    FORM: ClassVar[Document[Sums]] = Document(
        "units.schema.json#Components",
        lambda sums: {"components": sums},
        lambda content: content["components"],
        AGAIN,
    )

    voxels: Voxels
    box: Box
    smoothing_um: float
    iso: float
    background: LatticeField | None
    min_diagonal_um: float
    max_shift: float | None
    step: PlaneStep = (1, 1, 1)
    higher: float | None = None

    def run(self) -> Sums:
        """Return the sums. Raises SourceError."""
        volume = self.voxels.read(self.box)
        field = denoise(volume, self.smoothing_um, self.max_shift)
        if self.background is not None:
            field -= self.background.at(self.box)
        inside = field > np.float32(self.iso)
        higher = None if self.higher is None else field > np.float32(self.higher)
        found = sum_components(
            inside, volume.spacing_um, self.min_diagonal_um, self.step, higher=higher
        )
        return asdict(found)
