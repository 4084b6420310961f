"""Open a source by its address, once in each process."""

from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path

from stereocell import read
from stereocell.model.spacing import Point, Spacing
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from stereocell.read.decoded_chunks import forget_chunks
from stereocell.read.known_formats import format_of
from stereocell.storage.workspace import fetch


@dataclass(frozen=True, slots=True)
class SourceRef:
    """An address and the options of `read.open`.

    spacing_um   voxel spacing (z, y, x), um; empty: the file's own
    series       number of the image in a source of several, from 1; 0: the largest
    pattern      pattern of the file names of planes; empty: guessed
    axes         letters of an array whose format does not name its axes, such as `czyx`; empty: the
                 file's own
    dark         whether structures are dark, so that values are inverted
    fingerprint  fingerprint in the plan, because the address may hold another volume now; empty:
                 any volume is accepted
    """

    source: str
    time: int
    spacing_um: tuple[float, ...]
    series: int = 0
    fingerprint: str = ""
    pattern: str = ""
    axes: str = ""
    dark: bool = False

    def key_content(self) -> list[object]:
        """Return the content for a key: the volume and its reader, but never the address."""
        own = [getattr(self, one.name) for one in fields(self) if one.name != "source"]
        format = format_of(self.source)
        return [*own, format.name, format.version]


@dataclass(frozen=True, slots=True)
class Voxels:
    """One channel of a source, at one resolution level.

    spacing_um  voxel spacing of that level (z, y, x) in um, from the plan
    origin_um   centre of that level's voxel (0, 0, 0), (z, y, x) in um
    """

    ref: SourceRef
    channel: int
    level: int
    spacing_um: Spacing
    origin_um: Point

    def read(self, box: Box) -> Volume:
        """Return the voxels of a box. Raises SourceError."""
        return open_source(self.ref).read(self.channel, box, self.level)


# For references with a fingerprint: the reference under which the same dataset was opened before
opened_as: dict[SourceRef, SourceRef] = {}


def open_source(ref: SourceRef) -> read.Dataset:
    """Return the dataset, opened once for all calls with the same reference."""
    return _opened(opened_as.get(ref, ref))


@lru_cache(maxsize=2)
def _opened(ref: SourceRef) -> read.Dataset:
    return open_afresh(ref)


def forget_sources() -> None:
    """Open each source again when it is needed next."""
    opened_as.clear()
    _opened.cache_clear()
    forget_chunks()


def open_afresh(ref: SourceRef) -> read.Dataset:
    """Return the dataset from the files as they are now, even if it was opened before."""
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
