"""Read a source of a test, or return the one line that refuses it."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.errors import SourceError


def whole(dataset: read.Dataset, channel: int = 0) -> NDArray[Any]:
    """Return the voxels (z, y, x) of a channel at the finest level."""
    return dataset.read(channel, dataset.levels[0].box).voxels


def read_voxels(source: Path | str, channel: int = 0, **options: Any) -> NDArray[Any]:
    """Open a source; return the voxels (z, y, x) of a channel at the finest level."""
    return whole(read.open(source, **options), channel)


def read_levels(source: Path | str, **options: Any) -> None:
    """Open a source and read the first channel at every level."""
    dataset = read.open(source, **options)
    for index, level in enumerate(dataset.levels):
        dataset.read(0, level.box, index)


def refusing(read_source: Callable[..., object], *kinds: type[Exception]) -> Callable[..., str]:
    """Return a function that returns the error that reading a source must raise.

    kinds  the errors that are expected; none: SourceError

    The error is one line, which states what is expected.
    """

    def refusal(source: Path | str, **options: Any) -> str:
        with pytest.raises(kinds or SourceError) as caught:
            read_source(source, **options)
        line = str(caught.value)
        assert "\n" not in line
        assert any(word in line for word in ("expected", "needs", "is not installed"))
        return line

    return refusal
