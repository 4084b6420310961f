"""How a worker opens the source again: by its address, once a process."""

from dataclasses import dataclass
from functools import lru_cache

from stereocell import read
from stereocell.plan import Plan


@dataclass(frozen=True, slots=True)
class SourceRef:
    """An address and what was asked of it; (z, y, x) spacing in um, or empty for the file's own."""

    source: str
    time: int
    spacing_um: tuple[float, ...]


@lru_cache(maxsize=2)
def open_source(ref: SourceRef) -> read.Dataset:
    """Return the dataset, opened once for all calls with the same reference."""
    if not ref.spacing_um:
        return read.open(ref.source, time=ref.time)
    z, y, x = ref.spacing_um
    return read.open(ref.source, time=ref.time, spacing_um=(z, y, x))


def source_of(plan: Plan) -> SourceRef:
    """Return the reference to a plan's source."""
    return SourceRef(plan.source, plan.settings.plan.time, plan.settings.plan.spacing_um)
