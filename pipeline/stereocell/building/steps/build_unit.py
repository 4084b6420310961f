"""Build one unit, the surface and volume of one (tile, channel), on a worker. Picklable."""

import time
from dataclasses import dataclass, replace
from pathlib import Path

from stereocell.building.open_source import SourceRef, open_source
from stereocell.building.unit import UnitInput, build_unit
from stereocell.building.unit_files import save_unit


@dataclass(frozen=True, slots=True)
class UnitTask:
    ref: SourceRef
    level: int
    channel: int
    given: UnitInput
    directory: Path
    painted: int | None = None  # index of the channel that is sampled onto the surface


def run_unit(task: UnitTask) -> None:
    """Build one unit and write its folder. Raises SourceError, OutputError."""
    start = time.perf_counter()
    source, window = open_source(task.ref), task.given.lattice.window
    volume = source.read(task.channel, window, task.level)
    painted = None if task.painted is None else source.read(task.painted, window, task.level)
    seconds = time.perf_counter() - start
    built = build_unit(volume, task.given, painted=painted)
    save_unit(task.directory, replace(built, seconds={"read": seconds, **built.seconds}))
