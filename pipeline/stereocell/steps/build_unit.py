"""The step that builds one unit: the surface and the volume of one (tile, channel)."""

import time
from dataclasses import dataclass, replace
from typing import ClassVar

from stereocell.engine.step import Step
from stereocell.model.unit import Unit
from stereocell.read.decoded_chunks import forget_chunks
from stereocell.steps.open_source import Voxels
from stereocell.steps.unit import UnitInput, build_unit
from stereocell.steps.unit_files import UNIT_FOLDER, UnitFolder


@dataclass(frozen=True, slots=True)
class BuildUnit(Step[Unit]):
    """Build one unit.

    painted  channel that is painted on the surface; None: none is
    """

    VERSION: ClassVar[int] = 3
    FORM: ClassVar[UnitFolder] = UNIT_FOLDER

    voxels: Voxels
    given: UnitInput
    painted: Voxels | None = None

    def run(self) -> Unit:
        """Return the unit, with the seconds that each part took. Raises SourceError."""
        start = time.perf_counter()
        window = self.given.lattice.window
        volume = self.voxels.read(window)
        painted = None if self.painted is None else self.painted.read(window)
        forget_chunks()  # a unit needs more memory than all passes before it
        seconds = time.perf_counter() - start
        built = build_unit(volume, self.given, painted=painted)
        return replace(built, seconds={"read": seconds, **built.seconds})
