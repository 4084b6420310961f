"""The files of one volume in a folder: their paths, channels, and a note on their names."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice

from stereocell.read.dataset import StoredArray, VoxelArray
from stereocell.read.formats.planes.files import join
from stereocell.read.formats.planes.names import template_of
from stereocell.read.formats.planes.volume import Volume
from stereocell.read.image import Color, Image
from stereocell.read.spacing import PartialTriple, grid_of
from stereocell.storage.location import Location

Key = tuple[int, int, int]  # time, channel, plane
_AXES = ("t", "c", "z", "y", "x")
_SHOWN = 4  # names or numbers that a note lists at most
_NUMBER = re.compile(r"[0-9]{1,9}$")  # number at the end of a channel's name


@dataclass(frozen=True, slots=True)
class VolumeFiles:
    """The files of a volume in their folder."""

    location: Location
    volume: Volume

    def name(self, key: Key) -> str:
        """Return the path of a file below the folder."""
        return self.volume.files[key].path

    def path(self, key: Key) -> str:
        """Return the path of a file on the disk."""
        return join(self.location.source, self.name(key))

    def shown(self, key: Key) -> str:
        """Return folder and file, for messages."""
        return f"{self.location.shown}: {self.name(key)!r:.200}"

    @property
    def paths(self) -> tuple[str, ...]:
        """The paths of all files on the disk."""
        return tuple(self.path(key) for key in self.volume.files)

    @property
    def channels(self) -> tuple[tuple[str | None, ...], tuple[Color | None, ...]]:
        """Names and colours of the channels; the names come from the file names."""
        names = tuple(name or None for name in self.volume.channels)
        return names, (None,) * len(names)

    def image(
        self,
        array: StoredArray,
        spacing_um: PartialTriple,
        channels: tuple[tuple[str | None, ...], tuple[Color | None, ...]],
        notes: Sequence[str],
    ) -> Image:
        """Return the image of an array (t, c, z, y, x)."""
        voxels = VoxelArray(array, _AXES)
        grid = grid_of(voxels.shape, spacing_um)
        return Image((voxels,), (grid,), *channels, 1, notes=(self._read_as, *notes))

    @property
    def _read_as(self) -> str:
        """The note on how the names were interpreted."""
        volume, place = self.volume, self.volume.files[0, 0, 0]
        parts = []
        if len(volume.channels) > 1:
            shown = ", ".join(volume.channels[:_SHOWN])
            more = ", ..." if len(volume.channels) > _SHOWN else ""
            numbers = [int(found[0]) for name in volume.channels if (found := _NUMBER.search(name))]
            skipped = _skipped(numbers) if len(numbers) == len(volume.channels) else ""
            parts.append(f"{len(volume.channels)} channels ({shown}{more}{skipped})")
        if len(volume.times) > 1:
            skipped = _skipped(volume.times)
            parts.append(f"{len(volume.times)} time points{f' ({skipped[2:]})' * bool(skipped)}")
        if place.plane is not None:
            first, last, skipped = volume.planes[0], volume.planes[-1], _skipped(volume.planes)
            parts.append(f"{len(volume.planes)} planes ({first} to {last}{skipped})")
        description = " of ".join(parts) or "one stack"
        count = len(volume.files)
        return (
            f"{count} file{'s' * (count != 1)}, named like {template_of(place)}, read as "
            f"{description}"
        )


def _skipped(numbers: Sequence[int]) -> str:
    """Return the words for the numbers between the smallest and the largest that no name has."""
    least, largest = min(numbers), max(numbers)
    count = largest - least + 1 - len(set(numbers))
    if not count:
        return ""
    present = set(numbers)
    absent = (number for number in range(least, largest) if number not in present)
    shown = ", ".join(map(str, islice(absent, _SHOWN)))
    return f"; no file is numbered {shown}{', ...' if count > _SHOWN else ''}"
