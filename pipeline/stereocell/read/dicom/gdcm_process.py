"""GDCM in a process of its own: it aborts on some damaged JPEG streams, and it prints to stderr.

As a program, this module reads requests from stdin, a line of JSON each with `path` and `indices`.
It answers each frame with a line of JSON, `dtype` and `shape`, and the bytes, or with `null` where
the frame can't be decoded. Its stderr is discarded.
"""

import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.read.dicom.silence_logs import DICOM_FAULTS, quiet
from stereocell.read.dicom.stored_values import open_pixels, stored_values


class GdcmProcess:
    """Decodes files by GDCM; the process starts with the first file and ends with the block."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> "GdcmProcess":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()

    def decode(self, path: Path, indices: Sequence[int]) -> Iterator[NDArray[Any]]:
        """Yield the stored values (rows, columns) of frames. Raises ValueError, OSError."""
        if self._process is None:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", __name__],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
            )
        pipes = self._process
        assert pipes.stdin is not None
        assert pipes.stdout is not None
        request = {"path": str(path.absolute()), "indices": list(indices)}
        pipes.stdin.write(json.dumps(request).encode() + b"\n")
        pipes.stdin.flush()
        for _ in indices:
            answer = json.loads(pipes.stdout.readline() or "null")  # no line: the process is dead
            if answer is None:
                raise ValueError
            dtype, shape = np.dtype(answer["dtype"]), tuple(answer["shape"])
            content = pipes.stdout.read(int(np.prod(shape)) * dtype.itemsize)
            yield np.frombuffer(content, dtype).reshape(shape)


def main() -> None:
    """Answer requests until stdin ends."""
    for line in sys.stdin.buffer:
        request = json.loads(line)
        try:
            with quiet():
                dataset, plugin = open_pixels(Path(request["path"]))
                for values in stored_values(dataset, plugin, request["indices"]):
                    about = {"dtype": values.dtype.str, "shape": values.shape}
                    sys.stdout.buffer.write(json.dumps(about).encode() + b"\n")
                    sys.stdout.buffer.write(values.tobytes())
        except DICOM_FAULTS:
            sys.stdout.buffer.write(b"null\n")
        sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
