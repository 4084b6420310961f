"""A step of a build: a computation that runs once, and whose result is kept under a key.

The key is a hash of the step's class name, its VERSION and its fields. So a result stays valid
until somebody raises VERSION, even if the code changes. `make lint` compares the code that each
step reaches with a recorded digest. If it changed, the developer has to decide about VERSION.
"""

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, ClassVar, Generic, Protocol, TypeVar

import numpy as np

from stereocell.storage.json_files import find_sealed, read_sealed, write_sealed

R = TypeVar("R")
R_contra = TypeVar("R_contra", contravariant=True)
_KEY_DIGITS = 20  # hexadecimal digits of a key; 80 bits


class Form(Protocol[R_contra]):
    """The form in which a step's result lies in OUT."""

    def is_whole(self, place: Path) -> bool:
        """Return whether an undamaged result lies at a place."""

    def write(self, place: Path, result: R_contra) -> None:
        """Write a result completely or not at all. Raises OutputError."""


class Keyed:
    """Work that is skipped if its key has not changed. Subclasses are frozen dataclasses.

    All fields count in the key, so a subclass has no field that does not change the result. The
    exception is a field with `compare=False`, which only states where something lies.

    Work that a phase does as a whole is a direct subclass with a method of its own, such as
    `WriteStage.write` (see building/phase.py).

    VERSION  must be raised when the same fields give another result
    """

    __slots__ = ()
    VERSION: ClassVar[int]

    @property
    def key(self) -> str:
        """The name of the result, 20 hexadecimal digits."""
        counted = (one.name for one in fields(self) if one.compare)  # type: ignore[arg-type]
        own = {name: content_of(getattr(self, name)) for name in counted}
        return key_of([type(self).__name__, self.VERSION, own])


class Work(ABC):
    """Work for one worker, which writes its result to a place. Subclasses are picklable."""

    __slots__ = ()

    @abstractmethod
    def is_whole(self, place: Path) -> bool:
        """Return whether an undamaged result lies at a place."""

    @abstractmethod
    def keep(self, place: Path) -> None:
        """Compute the result, and write it completely or not at all. Raises OutputError."""


class Step(Keyed, Work, Generic[R]):
    """Work whose result is kept under a key.

    FORM  the form of the result in OUT
    """

    __slots__ = ()
    FORM: ClassVar[Form[Any]]

    @abstractmethod
    def run(self) -> R:
        """Compute the result and return it."""

    def is_whole(self, place: Path) -> bool:
        """Return whether an undamaged result lies at a place."""
        return self.FORM.is_whole(place)

    def keep(self, place: Path) -> None:
        """Compute the result and write it to a place. Raises OutputError."""
        self.FORM.write(place, self.run())


@dataclass(frozen=True, slots=True)
class Document(Generic[R]):
    """The form of a result that is a sealed JSON file with a schema.

    schema     file in schemas/, with `#Name` for one of its definitions
    to_json    converts the result to values of JSON
    from_json  converts content that fits the schema to the result
    remedy     what the user should do if the file is damaged
    """

    schema: str
    to_json: Callable[[R], Mapping[str, Any]]
    from_json: Callable[[Mapping[str, Any]], R]
    remedy: str

    def is_whole(self, place: Path) -> bool:
        """Return whether the file fits its schema and matches its hash."""
        return find_sealed(place, self.schema) is not None

    def write(self, place: Path, result: R) -> None:
        """Write the result. Raises OutputError."""
        write_sealed(place, self.to_json(result))

    def read(self, place: Path) -> R:
        """Return the result. Raises OutputError."""
        return self.from_json(read_sealed(place, self.schema, self.remedy))

    def find(self, place: Path) -> R | None:
        """Return the result; None: it is missing or damaged."""
        content = find_sealed(place, self.schema)
        return None if content is None else self.from_json(content)


def key_of(content: Any) -> str:
    """Return the key of some JSON values: the first digits of their SHA-256.

    >>> key_of({"level": 1}) == key_of({"level": 1}) != key_of({"level": 2})
    True
    """
    text = json.dumps(content, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:_KEY_DIGITS]


def content_of(value: Any) -> Any:
    """Return a field as values of JSON, for a key.

    An object with a `key_content` method is replaced by what it returns. So a source counts by its
    fingerprint and never by its path. A step counts by its own key. Raises TypeError for any other
    type, such as a path.
    """
    if isinstance(value, Keyed):
        return value.key
    if hasattr(value, "key_content"):
        return value.key_content()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        data = np.ascontiguousarray(value)
        return [data.dtype.str, list(data.shape), hashlib.sha256(data.tobytes()).hexdigest()]
    if is_dataclass(value) and not isinstance(value, type):
        return {one.name: content_of(getattr(value, one.name)) for one in fields(value)}
    if isinstance(value, Mapping):
        return [[content_of(name), content_of(one)] for name, one in sorted(value.items())]
    if isinstance(value, tuple | list):
        return [content_of(one) for one in value]
    if isinstance(value, set | frozenset):
        return sorted(content_of(one) for one in value)
    raise TypeError(f"a key contains a {type(value).__name__}, expected plain values")
