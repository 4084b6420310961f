"""A user's network: patches, blending, and errors in one line."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stereocell.model.errors import SourceError, UsageError
from stereocell.tissue.brain_mask import find_foreground
from stereocell.tissue.onnx_classifier import Network, apply_network
from support.onnx_models import Shape, write_model


def volume(shape: tuple[int, int, int] = (20, 30, 26)) -> np.ndarray[Any, Any]:
    rng = np.random.default_rng(0)
    voxels = np.zeros(shape)
    voxels[2:-2, 2:-2, 2:-2] = 500 + rng.normal(0, 80, [n - 4 for n in shape])
    return voxels.clip(0).astype(np.uint16)


def expected(voxels: np.ndarray[Any, Any], slopes: Sequence[float]) -> np.ndarray[Any, Any]:
    """Return the softmax of the whole volume at once; a convolution of one voxel has no patches."""
    from scipy import ndimage

    values = voxels.astype(np.float64)
    inside = find_foreground(ndimage.gaussian_filter(voxels.astype(np.float32), 0.8))
    scored = (values - values[inside].mean()) / values[inside].std()
    logits = np.array(slopes).reshape(-1, 1, 1, 1) * scored
    shares = np.exp(logits - logits.max(axis=0))
    return np.asarray(shares / shares.sum(axis=0))


def load(path: Path) -> Network:
    return Network.load(path, path.read_bytes())


@pytest.mark.parametrize("has_softmax", [False, True])
@pytest.mark.parametrize("patch", [(1, 1, 8, 8, 8), (1, 1, 16, 64, 9), (1, 1, "D", "H", "W")])
def test_blended_patches_equal_the_result_of_the_whole_volume(
    tmp_path: Path, patch: Shape, has_softmax: bool
) -> None:
    path = write_model(tmp_path / "m.onnx", shape=patch, has_softmax=has_softmax)
    network = load(path)
    assert network.classes == ("tissue 1", "tissue 2")
    voxels = volume()
    found = apply_network(network, voxels)
    np.testing.assert_allclose(found, expected(voxels, (-2.0, 3.0)), atol=2e-4)
    np.testing.assert_allclose(found.sum(axis=0), 1, atol=1e-5)
    assert apply_network(network, voxels).tobytes() == found.tobytes()


def test_a_model_may_name_its_classes_and_hide_some(tmp_path: Path) -> None:
    path = write_model(tmp_path / "m.onnx", slopes=(0, 1, 2), names=["", "bone", "marrow"])
    network = load(path)
    assert network.classes == ("", "bone", "marrow")
    assert network.count == 2


def test_the_settings_of_a_network_depend_on_its_bytes_and_not_its_name(tmp_path: Path) -> None:
    one = load(write_model(tmp_path / "Jane_Doe.onnx"))
    same = load(write_model(tmp_path / "b.onnx"))
    other = load(write_model(tmp_path / "c.onnx", slopes=(1, 2)))
    assert one.settings() == same.settings() != other.settings()
    assert "Jane" not in json.dumps(one.settings())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"shape": (1, 2, 8, 8, 8)}, r"input 'voxels' is tensor\(float\) of shape"),
        ({"shape": (1, 1, 9999, 8, 8)}, "requires patches of 9999 x 8 x 8"),
        ({"slopes": (1.0,)}, "with K from 2 to 32"),
        ({"names": ["a"]}, "expected a JSON list of 2"),
        ({"names": "no JSON"}, "expected a JSON list of 2"),
        ({"names": ["a", "a"]}, "different names"),
        ({"slopes": (float("nan"), 1.0)}, "NaN or infinity"),
    ],
)
def test_the_error_for_an_unsuitable_model_is_one_line(
    tmp_path: Path, options: dict[str, Any], message: str
) -> None:
    with pytest.raises(SourceError, match=message) as error:
        load(write_model(tmp_path / "m.onnx", **options))
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_a_model_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "m.onnx"
    for content in (b"root:x:0:0:root:/root:/bin/bash\n", b"", b"GIF89a"):
        path.write_bytes(content)
        with pytest.raises(SourceError) as error:
            load(path)
        assert str(error.value) == f"{path}: found another kind of file, expected an ONNX model"


def test_without_onnxruntime_the_error_says_how_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(UsageError, match=r"pip install 'stereocell\[onnx\]'"):
        load(write_model(tmp_path / "m.onnx"))
