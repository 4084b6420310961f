"""Choose the channels of a BigDataViewer image at one time point, and place them as registered.

A container lacks the views that the XML lists as missing (`MissingViews`). A channel without a view
at the chosen time point is left out, and a note says so.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from stereocell.model.errors import SourceError
from stereocell.read.bigdataviewer.described import Described
from stereocell.read.bigdataviewer.image import BdvLevel
from stereocell.read.bigdataviewer.registration import registered
from stereocell.read.dataset import VoxelArray
from stereocell.read.image import Image
from stereocell.read.statements import omission


def with_times(
    where: str, image: Image, described: Described, setups: Sequence[int], times: Sequence[int]
) -> Image:
    """Return an image with the channels and the registration of the chosen time point.

    setups  number of each channel's setup
    times   numbers of the time points
    """
    return replace(image, at_time=partial(_at_time, where, described, setups, times))


def _at_time(
    where: str,
    described: Described,
    setups: Sequence[int],
    times: Sequence[int],
    image: Image,
    index: int,
) -> Image:
    time = times[index]
    missing = [setup for setup in setups if (time, setup) in described.missing]
    present = [setup for setup in setups if setup not in missing]
    if not present:
        raise SourceError(
            f"{where}: time point {time}: found no view, since MissingViews of the XML lists "
            f"{_named(missing)}, expected another --time"
        )
    if missing:
        channels = [setups.index(setup) for setup in present]
        note = omission(
            _named(missing), f"the XML lists no view at time point {time} (MissingViews)"
        )
        image = replace(_of_channels(image, channels), notes=(*image.notes, note))
    return registered(image, described, present, time)


def _named(setups: Sequence[int]) -> str:
    numbers = ", ".join(map(str, setups))
    return f"setup{'s' * (len(setups) > 1)} {numbers}"


def _of_channels(image: Image, channels: Sequence[int]) -> Image:
    arrays = []
    for level in image.arrays:
        assert isinstance(level.array, BdvLevel)
        arrays.append(VoxelArray(level.array.of_channels(channels), level.axes))
    return replace(
        image,
        arrays=tuple(arrays),
        names=tuple(image.names[channel] for channel in channels),
        colors=tuple(image.colors[channel] for channel in channels),
    )
