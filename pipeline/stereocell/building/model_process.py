"""Run a user's network in a process of its own, with bounds on its time and memory.

The bounds apply to loading, and to each patch. Usual networks stay below the defaults: a 3D U-Net
of 30 million weights takes a minute and 3 GB for a patch of 128^3 voxels.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import SourceError, UsageError
from stereocell.storage.child_process import Bounds, Child, ChildError
from stereocell.storage.file_states import unchanged_while_read
from stereocell.storage.location import Location
from stereocell.tissue.onnx_classifier import Network
from stereocell.tissue.onnx_session import OnnxSession, Tensor

_MOST = 1e6  # s, GB: largest bound that a user may set; 1e6 s are a week and a half
_LONGEST_NAME = 100  # characters; longest name of a class, which also names a channel and files


@dataclass(frozen=True, slots=True)
class ModelBounds:
    """Bounds on a network.

    seconds    longest time for loading the network, and for each patch, s
    memory_gb  largest resident memory, 10^9 bytes
    """

    seconds: float = 300.0
    memory_gb: float = 4.0

    def __post_init__(self) -> None:
        for flag, value in (
            ("--model-seconds", self.seconds),
            ("--model-memory-gb", self.memory_gb),
        ):
            if not 0 < value <= _MOST:
                raise UsageError(
                    f"{flag} is {value:g}, expected a number above 0 and at most {_MOST:g}"
                )


@contextmanager
def opened_network(path: Path, bounds: ModelBounds) -> Iterator[Network]:
    """Yield the network of a file. Its process ends with the block.

    Raises SourceError and UsageError as `Network.load` does, and SourceError if it exceeds a bound.
    """
    with unchanged_while_read(Location.of(path), "run `stereocell tissue OUT` again"):
        try:
            content = path.read_bytes()
        except OSError as error:
            raise SourceError(f"{path}: {error.strerror}, expected an ONNX model") from None
    session = _ChildSession(path, bounds)
    try:
        network = Network.load(path, content, session.open)
        _require_printable(path, network)
        yield network
    finally:
        session.close()


def _require_printable(path: Path, network: Network) -> None:
    """Raise SourceError if the name of a class is too long or can't be printed."""
    for name in network.classes:
        if not name.isprintable() or len(name) > _LONGEST_NAME:
            raise SourceError(
                f"{path}: name of a class is {name!r:.80}, expected at most {_LONGEST_NAME} "
                "printable characters: rename it in the model's metadata"
            )


class _ChildSession:
    """The session of a network, in a child process."""

    def __init__(self, path: Path, bounds: ModelBounds) -> None:
        self._path, self._bounds = path, bounds
        self._child: Child | None = None

    def open(self, content: bytes) -> "_ChildSession":
        bounds = Bounds(self._bounds.seconds, int(1e9 * self._bounds.memory_gb))

        def start() -> Child:
            return Child(OnnxSession, content, bounds=bounds)

        self._child = self._guard("loaded", start)
        return self

    def close(self) -> None:
        if self._child is not None:
            self._child.close()

    def inputs(self) -> tuple[Tensor, ...]:
        found: tuple[Tensor, ...] = self._call("loaded", "inputs")
        return found

    def outputs(self) -> tuple[Tensor, ...]:
        found: tuple[Tensor, ...] = self._call("loaded", "outputs")
        return found

    def metadata(self, key: str) -> str | None:
        found: str | None = self._call("loaded", "metadata", key)
        return found

    def run(self, values: NDArray[np.float32]) -> NDArray[Any]:
        found: NDArray[Any] = self._call("run on a patch", "run", values)
        return found

    def _call(self, doing: str, method: str, *arguments: Any) -> Any:
        child = self._child
        assert child is not None
        return self._guard(doing, lambda: child.call(method, *arguments))

    def _guard(self, doing: str, work: Callable[[], Any]) -> Any:
        try:
            return work()
        except ChildError as error:
            raise SourceError(
                f"{self._path}: {error} while it was {doing}, expected at most "
                f"{self._bounds.seconds:g} s for each patch and {self._bounds.memory_gb:g} GB: "
                "raise --model-seconds or --model-memory-gb if the network needs more"
            ) from None
