"""Run GDCM in a separate process, because it aborts on some damaged JPEGs and prints to stderr."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from stereocell.read.formats.dicom.silence_logs import DICOM_FAULTS, quiet
from stereocell.read.formats.dicom.stored_values import open_pixels, stored_values
from stereocell.storage.child_process import Child, ChildError


class GdcmProcess:
    """Decodes files with GDCM. The first file starts the process; leaving `with` ends it."""

    def __init__(self) -> None:
        self._child: Child | None = None

    def __enter__(self) -> "GdcmProcess":
        return self

    def __exit__(self, *_: object) -> None:
        if self._child is not None:
            self._child.close()

    def decode(self, path: Path, indices: Sequence[int]) -> Iterator[NDArray[Any]]:
        """Yield the stored values (rows, columns) of frames, one at a time. Raises ValueError."""
        try:
            if self._child is None:
                self._child = Child(_Decoder)
            self._child.call("open", path.absolute(), list(indices))
            for _ in indices:
                yield self._child.call("next_frame")
        except ChildError:  # GDCM has aborted
            raise ValueError from None


class _Decoder:
    """The object in the process, which decodes the frames of one file after another."""

    def __init__(self) -> None:
        self._frames: Iterator[NDArray[Any]] = iter(())

    def open(self, path: Path, indices: Sequence[int]) -> None:
        """Open a file. Raises ValueError without text, since other errors quote values of tags."""
        try:
            with quiet():
                dataset, plugin = open_pixels(path)
                self._frames = stored_values(dataset, plugin, indices)
        except DICOM_FAULTS:
            raise ValueError from None

    def next_frame(self) -> NDArray[Any]:
        """Return the next frame of the open file. Raises ValueError like `open`."""
        try:
            with quiet():
                return next(self._frames)
        except (StopIteration, *DICOM_FAULTS):
            raise ValueError from None
