"""Each field of each step changes its key, at any depth, and paths do not."""

import copy
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stereocell.cli.__main__ import main
from stereocell.engine.step import Keyed
from stereocell.model.object_table import ObjectTable, SharedInterfaces
from stereocell.steps.learn_tissue import LearnTissue
from stereocell.tissue.classify import TissueOptions
from stereocell.tissue.onnx_classifier import Network
from support import phantoms
from support.onnx_models import write_model
from support.step_record import find_steps

SHAPE = (16, 24, 48)
# Fields that another field stands for, or that only name a place
PLACES = {("SourceRef", "source"), ("Labels", "name"), ("Labels", "shape"), ("Labels", "color")}
PLACES |= {("WriteStageTile", "stage_dir"), ("WriteStageTile", "parts_dir")}


@pytest.fixture(scope="module")
def steps(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Keyed]:
    """One step of each class, of a build of two tiles, two channels and objects."""
    folder = tmp_path_factory.mktemp("build")
    field = phantoms.blurred_ball(SHAPE, (1, 1, 1), (8, 12, 24), 6.0, 1.0)
    counts = phantoms.as_counts(field, 100, 1100, noise=5.0)
    image, labels = folder / "i.ome.tif", folder / "l.ome.tif"
    phantoms.write_ome_tiff(image, np.stack([counts, counts[:, ::-1]]), "CZYX")
    phantoms.write_ome_tiff(labels, (field > 0.5).astype(np.uint16), "ZYX")
    found: dict[str, Keyed] = {}
    right = Keyed.key.fget
    assert right is not None

    def key(self: Keyed) -> str:
        found[type(self).__name__] = self
        return str(right(self))

    flags = ["--grid", "2x1", "--labels", f"cells={labels}", "--workers", "0"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Keyed, "key", property(key))
        assert main(["build", str(image), "-o", str(folder / "out"), *flags]) == 0
    window = found["FindWindow"]
    found["LearnTissue"] = LearnTissue(
        window.voxels,  # type: ignore[attr-defined]
        window.region,  # type: ignore[attr-defined]
        "MR",
        TissueOptions(classes=3),
        ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    )
    return found


def test_the_tested_build_has_a_step_of_each_class(steps: dict[str, Keyed]) -> None:
    assert steps.keys() == {step.__name__ for step in find_steps()}


@pytest.mark.parametrize("name", [step.__name__ for step in find_steps()])
def test_each_field_changes_the_key_and_no_path_does(steps: dict[str, Keyed], name: str) -> None:
    step = steps[name]
    changed = 0
    for path, other in variants(step):
        if path[-1] in PLACES:
            assert other.key == step.key, path
        else:
            assert other.key != step.key, path
            changed += 1
    counted = [one for one in fields(step) if one.compare]  # type: ignore[arg-type]
    assert changed >= len(counted)


def test_a_network_counts_by_its_file_and_classes_and_never_by_its_name(
    steps: dict[str, Keyed], tmp_path: Path
) -> None:
    def key(name: str, names: list[str], slope: float = 1.0) -> str:
        path = write_model(tmp_path / name, slopes=(0.0, slope), names=names)
        network = Network.load(path, path.read_bytes())
        return replace(steps["LearnTissue"], method=network).key  # type: ignore[call-arg]

    first = key("a.onnx", ["bone", "marrow"])
    assert key("b.onnx", ["bone", "marrow"]) == first
    keys = {key("a.onnx", ["bone", "marrow"], 2.0), key("a.onnx", ["bone", ""])}
    assert len({first, steps["LearnTissue"].key, *keys}) == 4


Path_ = tuple[tuple[str, str], ...]  # names of class and field, from the step inwards


def variants(value: Any) -> Iterator[tuple[Path_, Any]]:
    """Yield a copy of a dataclass for each of its values, at any depth, with this value changed."""
    for one in fields(value):
        here = (type(value).__name__, one.name)
        for path, other in _others(getattr(value, one.name)):
            changed = copy.copy(value)
            object.__setattr__(changed, one.name, other)
            yield (here, *path), changed


def _others(value: Any) -> Iterator[tuple[Path_, Any]]:
    if isinstance(value, ObjectTable):
        yield (), replace(value, labels=np.append(value.labels, np.uint64(7)))
    elif isinstance(value, SharedInterfaces):
        yield (), replace(value, area_um2=np.append(value.area_um2, 1.0))
    elif is_dataclass(value) and fields(value):
        yield from variants(value)
    elif isinstance(value, np.ndarray):
        yield (), np.append(value, np.ones(1, value.dtype))
    elif isinstance(value, Mapping):
        yield (), {**value, "another": next(iter(value.values()), 1)}
        for name, one in value.items():
            for path, other in _others(one):
                yield path, {**value, name: other}
    elif isinstance(value, tuple):
        yield (), (*value, value[-1] if value else 7)
        for place, one in enumerate(value[:2]):
            for path, other in _others(one):
                yield path, (*value[:place], other, *value[place + 1 :])
    elif isinstance(value, frozenset):
        yield (), value | {"another"}
    elif isinstance(value, Path):
        yield (), value / "another"
    elif isinstance(value, bool):
        yield (), not value
    elif isinstance(value, int | float):
        yield (), value + 1
    else:
        yield (), f"another {value}"
