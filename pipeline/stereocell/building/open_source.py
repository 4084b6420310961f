"""Open the source in a worker again: by its address, once per process."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from stereocell import read
from stereocell.building.settings import PlanOptions
from stereocell.storage.workspace import fetch


@dataclass(frozen=True, slots=True)
class SourceRef:
    """An address and the options of `read.open`.

    spacing_um   (z, y, x), um, or empty for the file's own
    series       of a source of several images, from 1; 0: the largest
    pattern      of the names of planes, or empty
    axes         letters of an array whose format leaves them open, as `czyx`, or empty
    dark         whether structures are dark, so that values are inverted
    fingerprint  the planned one, since the address may hold another volume now; empty: any volume
    """

    source: str
    time: int
    spacing_um: tuple[float, ...]
    series: int = 0
    fingerprint: str = ""
    pattern: str = ""
    axes: str = ""
    dark: bool = False


@lru_cache(maxsize=2)
def open_source(ref: SourceRef) -> read.Dataset:
    """Return the dataset, opened once for all calls with the same reference."""
    return open_afresh(ref)


def open_afresh(ref: SourceRef) -> read.Dataset:
    """Return the dataset as the files are now, even if this process opened it before."""
    fetch(Path(ref.source))  # an added channel's source lies in OUT
    given = None
    if ref.spacing_um:
        z, y, x = ref.spacing_um
        given = (z, y, x)
    return read.open(
        ref.source,
        time=ref.time,
        spacing_um=given,
        series=ref.series,
        pattern=ref.pattern,
        axes=ref.axes,
        dark=ref.dark,
    )


def as_asked(source: str, options: PlanOptions, *, fingerprint: str = "") -> SourceRef:
    """Return the reference to a source that is read as the settings say."""
    return SourceRef(
        source,
        options.time,
        options.spacing_um,
        options.series,
        fingerprint,
        options.pattern,
        options.axes,
        options.dark,
    )
