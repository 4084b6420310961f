"""A step's key follows its name, VERSION and fields, and nothing else."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.engine.step import Keyed, content_of


@dataclass(frozen=True, slots=True)
class Source:
    path: str
    fingerprint: str

    def key_content(self) -> str:
        return self.fingerprint


@dataclass(frozen=True, slots=True)
class Sum(Keyed):
    VERSION: ClassVar[int] = 1

    source: Source
    numbers: tuple[int, ...] = (1, 2)
    weights: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True)
class Placed(Keyed):
    VERSION: ClassVar[int] = 1

    number: int
    folder: Path = field(compare=False)


@dataclass(frozen=True, slots=True)
class Mean(Keyed):
    VERSION: ClassVar[int] = 1

    source: Source
    numbers: tuple[int, ...] = (1, 2)
    weights: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True)
class Twice(Keyed):
    VERSION: ClassVar[int] = 1

    first: Sum


HERE, THERE = Source("/here/a.tif", "f1"), Source("/there/b.tif", "f1")


def test_a_source_counts_in_a_key_by_its_fingerprint_and_not_by_its_path() -> None:
    assert Sum(HERE).key == Sum(THERE).key
    assert Sum(HERE).key != Sum(Source("/here/a.tif", "f2")).key


def test_a_field_without_comparison_does_not_count() -> None:
    assert Placed(1, Path("/here")).key == Placed(1, Path("/there")).key
    assert Placed(1, Path("/here")).key != Placed(2, Path("/here")).key


def test_the_class_counts_by_its_name_and_its_version(monkeypatch: pytest.MonkeyPatch) -> None:
    before = Sum(HERE).key
    assert before != Mean(HERE).key
    monkeypatch.setattr(Sum, "VERSION", 2)
    assert Sum(HERE).key != before


def test_a_step_that_holds_another_follows_its_version(monkeypatch: pytest.MonkeyPatch) -> None:
    before = Twice(Sum(HERE)).key
    monkeypatch.setattr(Sum, "VERSION", 2)
    assert Twice(Sum(HERE)).key != before


def test_arrays_count_in_a_key_by_their_values_shape_and_type() -> None:
    arrays = [
        np.arange(4.0),
        np.arange(4.0)[::-1],
        np.arange(4.0).reshape(2, 2),
        np.arange(4, dtype=np.float32),
    ]
    assert len({Sum(HERE, weights=array).key for array in arrays}) == 4
    assert Sum(HERE, weights=np.arange(8.0)[::2]).key == Sum(HERE, weights=2 * np.arange(4.0)).key


@pytest.mark.parametrize(
    ("one", "other", "is_same"),
    [
        ({"a": 1, "b": 2}, {"b": 2, "a": 1}, True),
        ({"a": 1}, {"a": 2}, False),
        (frozenset("abc"), frozenset("cba"), True),
        ((1, 2), (2, 1), False),
        (1, "1", False),
        (None, "", False),
    ],
)
def test_the_order_of_a_mapping_does_not_count(one: Any, other: Any, is_same: bool) -> None:
    assert (content_of(one) == content_of(other)) == is_same


@pytest.mark.parametrize("value", [Path("/a"), object(), len, {"a": Path("b")}])
def test_a_path_is_refused_in_a_key(value: object) -> None:
    with pytest.raises(TypeError, match="expected plain values"):
        content_of(value)


def test_numpy_s_numbers_count_like_python_s() -> None:
    assert content_of(np.float64(2.5)) == 2.5
    assert content_of((np.int64(3), np.bool_(True))) == [3, True]
    found: Mapping[str, Any] = {"a": np.int32(3)}
    assert content_of(found) == [["a", 3]]
