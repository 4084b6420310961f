"""A network that exceeds its time or memory, or ends its process, is refused in one line."""

from argparse import ArgumentParser
from pathlib import Path

import numpy as np
import pytest

from stereocell.building.model_process import ModelBounds, opened_network
from stereocell.cli.flags import declare_tissue
from stereocell.model.errors import SourceError, UsageError
from stereocell.tissue.onnx_classifier import Network, apply_network
from support.onnx_models import write_endless_model, write_huge_model, write_model


def refusal(path: Path, bounds: ModelBounds) -> str:
    with pytest.raises(SourceError) as caught, opened_network(path, bounds):
        pass
    line = str(caught.value)
    assert line.startswith(f"{path}: ")
    assert "\n" not in line
    return line


def test_a_network_gives_the_same_bytes_in_a_process_of_its_own(tmp_path: Path) -> None:
    path = write_model(tmp_path / "m.onnx", slopes=(0, 1, 2), names=["", "bone", "marrow"])
    voxels = np.zeros((20, 24, 30), np.uint16)
    voxels[4:16, 4:20, 4:26] = np.arange(12 * 16 * 22).reshape(12, 16, 22)
    here = Network.load(path, path.read_bytes())
    with opened_network(path, ModelBounds()) as apart:
        assert apart == here
        assert apply_network(apart, voxels).tobytes() == apply_network(here, voxels).tobytes()


def test_a_network_that_loops_without_end_is_ended_at_its_bound(tmp_path: Path) -> None:
    line = refusal(write_endless_model(tmp_path / "m.onnx"), ModelBounds(seconds=3))
    assert "it did not end within 3 s" in line
    assert "raise --model-seconds" in line


def test_a_network_of_more_memory_than_its_bound_is_refused(tmp_path: Path) -> None:
    line = refusal(write_huge_model(tmp_path / "m.onnx"), ModelBounds(memory_gb=0.6))
    assert "it took more than 0.6 GB of memory" in line
    assert "--model-memory-gb" in line


def test_a_tensor_beyond_this_machine_names_the_bound_to_raise(tmp_path: Path) -> None:
    line = refusal(write_huge_model(tmp_path / "m.onnx", planes=1 << 44), ModelBounds())
    assert "it needs more memory than allowed" in line
    assert "--model-memory-gb" in line
    assert "bfc_arena" not in line


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["x" * 101, "b"], "name of a class is 'xxxxxxxx"),
        (["x" * 5000, "b"], "name of a class is 'xxxxxxxx"),
        (["a\nb", "c"], "name of a class is 'a\\nb', expected at most 100 printable characters"),
        ("[" * 100_000, "metadata 'stereocell_classes' is '[[["),
    ],
)
def test_class_names_that_no_channel_can_have_are_refused(
    tmp_path: Path, names: object, message: str
) -> None:
    line = refusal(write_model(tmp_path / "m.onnx", names=names), ModelBounds())
    assert message in line
    assert len(line) < 500


def test_a_file_that_is_not_a_network_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "m.onnx").write_bytes(b"GIF89a")
    line = refusal(tmp_path / "m.onnx", ModelBounds())
    assert line.endswith("found another kind of file, expected an ONNX model")


@pytest.mark.parametrize("value", [0.0, -1.0, 1e300, float("nan"), float("inf")])
def test_a_bound_that_is_not_a_positive_number_is_refused(value: float) -> None:
    with pytest.raises(UsageError, match="--model-seconds"):
        ModelBounds(seconds=value)
    with pytest.raises(UsageError, match="--model-memory-gb"):
        ModelBounds(memory_gb=value)


def test_the_flags_have_the_same_defaults_as_the_bounds() -> None:
    parser = ArgumentParser()
    declare_tissue(parser)
    flags = parser.parse_args(["OUT"])
    assert ModelBounds(flags.model_seconds, flags.model_memory_gb) == ModelBounds()
