"""A network of the user, in an ONNX file, that classifies voxels.

Patches overlap by half and are blended by a Gaussian, as in nnU-Net. The network runs on one thread
of the processor, so the same voxels give the same bytes.

Input   float32 (1, 1, D, H, W): (voxel - mean) / deviation, both over the foreground. D, H, W are
        the model's fixed sizes, or else 64.
Output  float32 (1, K, D, H, W): probabilities; any other values are treated as logits (softmax).

References
F. Isensee, P. F. Jaeger, S. A. A. Kohl, J. Petersen & K. H. Maier-Hein, "nnU-Net: a
self-configuring method for deep learning-based biomedical image segmentation", Nature Methods 18,
2021. doi:10.1038/s41592-020-01008-z
"""

import hashlib
import itertools
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from stereocell.model.errors import SourceError
from stereocell.tissue.brain_mask import find_foreground
from stereocell.tissue.onnx_session import OnnxError, OnnxSession, Session

Field = NDArray[np.float32]
PATCH = 64  # edge of a patch in voxels if the model leaves it open
LARGEST = 512  # largest edge in voxels that a model may require
MAX_CLASSES = 32  # largest number of outputs of a model
NAMES_KEY = "stereocell_classes"  # metadata of the model: a JSON list of K names; "" hides a class


@dataclass(frozen=True, slots=True)
class Network:
    """A loaded network that classifies voxels.

    digest   SHA-256 of the file, hexadecimal
    patch    (z, y, x), voxels
    classes  names of its K outputs; a class with an empty name is not shown
    """

    name: str
    digest: str
    patch: tuple[int, int, int]
    classes: tuple[str, ...]
    session: Session = field(repr=False, compare=False)

    @property
    def count(self) -> int:
        """The number of the network's classes that are shown."""
        return sum(bool(name) for name in self.classes)

    def settings(self) -> dict[str, Any]:
        """Return the settings on which the result depends. They include no path or file name."""
        return {
            "model": self.digest,
            "patch": list(self.patch),
            "names": list(self.classes),
            "onnxruntime": version("onnxruntime"),
        }

    def key_content(self) -> dict[str, Any]:
        """Return the settings, by which `engine.step` decides whether a result is still valid."""
        return self.settings()

    @classmethod
    def load(
        cls,
        path: Path,
        content: bytes,
        open_session: Callable[[bytes], Session] = OnnxSession,
    ) -> "Network":
        """Return the model from a file's content, after a test on one empty patch.

        path          path of the file, for the model's name and for messages
        open_session  opens a session that runs the network; by default in this process

        Raises UsageError if onnxruntime is not installed, SourceError if the file is not such a
        model.
        """
        try:
            session = open_session(content)
        except OnnxError as error:
            raise SourceError(f"{path}: {error}, expected an ONNX model") from None
        patch = _patch(path, session)
        tried = _run(str(path), session, np.zeros(patch, np.float32))
        names = _names(path, session, tried.shape[0])
        return cls(path.name, hashlib.sha256(content).hexdigest(), patch, names, session)


def apply_network(network: Network, voxels: NDArray[Any]) -> Field:
    """Return the probabilities of the classes, float32 (k, z, y, x), with a sum of 1.

    voxels  (z, y, x), any number type

    Raises SourceError if the network fails, or returns other shapes or infinite numbers.
    """
    values = voxels.astype(np.float32)
    inside = values[find_foreground(ndimage.gaussian_filter(values, 0.8))]
    values -= inside.mean(dtype=np.float64)
    values /= max(float(inside.std(dtype=np.float64)), 1e-12)
    missing = [max(0, p - n) for p, n in zip(network.patch, values.shape, strict=True)]
    padded = np.pad(values, [(0, n) for n in missing], mode="edge")
    weight = _gaussian(network.patch)
    total = np.zeros((len(network.classes), *padded.shape), np.float32)
    weights = np.zeros(padded.shape, np.float32)
    is_probability: bool | None = None
    starts = [_starts(n, p) for n, p in zip(padded.shape, network.patch, strict=True)]
    for corner in itertools.product(*starts):
        box = tuple(slice(a, a + p) for a, p in zip(corner, network.patch, strict=True))
        found = _run(network.name, network.session, padded[box])
        if is_probability is None:  # decided on the first patch, for all patches
            is_probability = bool(found.min() >= 0 and np.abs(found.sum(axis=0) - 1).max() < 1e-3)
        if not is_probability:
            found = np.exp(found - found.max(axis=0))
        found = np.clip(found, 0, None)
        found /= np.maximum(found.sum(axis=0), 1e-12)
        total[(slice(None), *box)] += weight * found
        weights[box] += weight
    total /= weights
    z, y, x = values.shape
    return total[:, :z, :y, :x]


def _starts(length: int, patch: int) -> list[int]:
    """Return the starts of patches that overlap by half. The last patch ends at the axis' end."""
    step = max(1, patch // 2)
    return [*range(0, length - patch, step), length - patch]


def _gaussian(patch: tuple[int, int, int]) -> Field:
    parts = [np.exp(-0.5 * ((np.arange(n) - (n - 1) / 2) / max(n / 8, 0.5)) ** 2) for n in patch]
    weight = np.einsum("z,y,x->zyx", *parts)
    return np.maximum(weight, 1e-4).astype(np.float32)


def _patch(path: Path, session: Session) -> tuple[int, int, int]:
    inputs, outputs = session.inputs(), session.outputs()
    if len(inputs) != 1 or len(outputs) != 1:
        raise SourceError(
            f"{path}: found {len(inputs)} inputs and {len(outputs)} outputs, expected one of each"
        )
    shape, kind = inputs[0].shape, inputs[0].kind
    is_fit = len(shape) == 5 and all(n == 1 for n in shape[:2] if isinstance(n, int))
    if kind != "tensor(float)" or not is_fit:
        raise SourceError(
            f"{path}: input {inputs[0].name!r} is {kind} of shape {list(shape)}, expected "
            "tensor(float) of shape (1, 1, D, H, W)"
        )
    z, y, x = (n if isinstance(n, int) else PATCH for n in shape[2:])
    if not all(1 <= n <= LARGEST for n in (z, y, x)):
        raise SourceError(
            f"{path}: input {inputs[0].name!r} requires patches of {z} x {y} x {x} voxels, "
            f"expected 1 to {LARGEST} along each axis"
        )
    return z, y, x


def _run(where: str, session: Session, patch: Field) -> Field:
    try:
        result = session.run(patch[None, None])
    except OnnxError as error:
        raise SourceError(f"{where}: failed on a patch of {patch.shape}: {error}") from None
    shape = result.shape
    is_fit = len(shape) == 5 and shape[0] == 1 and shape[2:] == patch.shape
    if not is_fit or not 2 <= shape[1] <= MAX_CLASSES or result.dtype.kind != "f":
        expected = ", ".join(str(n) for n in patch.shape)
        raise SourceError(
            f"{where}: output is {result.dtype} of shape {shape}, expected floats of shape "
            f"(1, K, {expected}) with K from 2 to {MAX_CLASSES}"
        )
    if not np.isfinite(result).all():
        raise SourceError(f"{where}: output holds NaN or infinity, expected finite numbers")
    return result[0].astype(np.float32)


def _names(path: Path, session: Session, count: int) -> tuple[str, ...]:
    text = session.metadata(NAMES_KEY)
    if text is None:
        return tuple(f"tissue {k + 1}" for k in range(count))
    try:
        names = json.loads(text)
    except (ValueError, RecursionError):
        names = None
    is_list = isinstance(names, list) and all(isinstance(name, str) for name in names)
    shown = [name for name in names if name] if is_list else []
    if not is_list or len(names) != count or len(set(shown)) != len(shown) or not shown:
        raise SourceError(
            f"{path}: metadata {NAMES_KEY!r} is {text[:80]!r}, expected a JSON list of {count} "
            "different names (an empty name hides its class)"
        )
    return tuple(names)
