"""Run a network of an ONNX file in onnxruntime, on one thread of the processor.

A network is a program: it may loop without end or allocate any amount of memory, and the runtime
bounds neither. So the caller runs this object in another process (building/model_process.py).
"""

import re
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import StereoCellError
from stereocell.model.extra_packages import import_extra

# Texts with which the runtime reports that it gets no memory, for which it has no class of errors
_NO_MEMORY = re.compile(r"bfc_arena|bad_alloc|bad allocation|[Ff]ailed to allocate")


class OnnxError(StereoCellError):
    """The runtime refuses a network, or fails. The text is the reason, without the file's name."""


@dataclass(frozen=True, slots=True)
class Tensor:
    """An input or output. Sizes are numbers, or names where the model leaves them open."""

    name: str
    shape: tuple[int | str | None, ...]
    kind: str


class Session(Protocol):
    """A session that runs a network. `run` and `inputs` raise OnnxError."""

    def inputs(self) -> tuple[Tensor, ...]: ...
    def outputs(self) -> tuple[Tensor, ...]: ...
    def metadata(self, key: str) -> str | None: ...
    def run(self, values: NDArray[np.float32]) -> NDArray[Any]: ...


class OnnxSession:
    """A loaded network.

    Raises UsageError if onnxruntime is not installed, OnnxError if the content is not a model.
    """

    def __init__(self, content: bytes) -> None:
        onnxruntime = _find_runtime()
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = 4
        try:
            self._session = onnxruntime.InferenceSession(
                content, options, providers=["CPUExecutionProvider"]
            )
        except _errors() as error:
            raise OnnxError(_reason(error)) from None

    def inputs(self) -> tuple[Tensor, ...]:
        return tuple(Tensor(i.name, tuple(i.shape), i.type) for i in self._session.get_inputs())

    def outputs(self) -> tuple[Tensor, ...]:
        return tuple(Tensor(o.name, tuple(o.shape), o.type) for o in self._session.get_outputs())

    def metadata(self, key: str) -> str | None:
        """Return a text of the model's own metadata, or None if it has none of that key."""
        found: str | None = self._session.get_modelmeta().custom_metadata_map.get(key)
        return found

    def run(self, values: NDArray[np.float32]) -> NDArray[Any]:
        """Return the output of a network of one input and one output."""
        try:
            (found,) = self._session.run(None, {self._session.get_inputs()[0].name: values})
        except _errors() as error:
            raise OnnxError(_reason(error)) from None
        return np.asarray(found)


def _find_runtime() -> Any:
    """Return onnxruntime. Raises UsageError if it is not installed."""
    return import_extra("onnxruntime", extra="onnx", wanted_by="--model")


def _errors() -> tuple[type[Exception], ...]:
    """Return onnxruntime's errors, which have no common class."""
    state = import_module("onnxruntime.capi.onnxruntime_pybind11_state")
    found = (v for v in vars(state).values() if isinstance(v, type) and issubclass(v, Exception))
    return (*found, RuntimeError, ValueError)


def _reason(error: Exception) -> str:
    """Return the runtime's message without its name and codes, in one line."""
    text = " ".join(str(error).split())
    if "protobuf" in text:  # the file could not be parsed, or holds no graph
        return "found another kind of file"
    if _NO_MEMORY.search(text):
        return "it needs more memory than allowed; if the model is right, raise --model-memory-gb"
    return re.sub(r"^\[ONNXRuntimeError\] : \d+ : \w+ : ", "", text)[:200]
