"""A step of a build: something that is computed once, and kept under a key of its inputs.

The key of a result is a hash of the step's class name, its VERSION and its fields. So a result
stays valid until somebody raises VERSION, whatever else changes in the code. `make lint` compares
the code that each step reaches with a recorded digest, and asks for a decision where it changed.
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
_KEY_DIGITS = 20  # hexadecimal: 80 bits


class Form(Protocol[R_contra]):
    """The form in which a step's result lies in OUT."""

    def is_whole(self, place: Path) -> bool:
        """Return whether a result lies there, as it was written."""

    def write(self, place: Path, result: R_contra) -> None:
        """Write a result, whole or not at all. Raises OutputError."""


class Keyed:
    """Work that is skipped where its key is unchanged. Subclasses are frozen dataclasses.

    A field that does not change the result is not a field, except one with `compare=False`: it only
    says where something lies. Work that a phase carries out as a whole is a direct subclass, with a
    method of its own, as `write` of `WriteStage`: see building/phase.py.

    VERSION  is raised when the same fields give another result
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
    """The work of one worker: it writes files at a place. Subclasses are picklable."""

    __slots__ = ()

    @abstractmethod
    def is_whole(self, place: Path) -> bool:
        """Return whether the result lies at a place, as it was written."""

    @abstractmethod
    def keep(self, place: Path) -> None:
        """Compute the result and write it to a place, whole or not at all. Raises OutputError."""


class Step(Keyed, Work, Generic[R]):
    """Work whose result is kept under a key.

    FORM  the form of the result in OUT
    """

    __slots__ = ()
    FORM: ClassVar[Form[Any]]

    @abstractmethod
    def run(self) -> R:
        """Compute the result."""

    def is_whole(self, place: Path) -> bool:
        """Return whether the result lies at a place, as it was written."""
        return self.FORM.is_whole(place)

    def keep(self, place: Path) -> None:
        """Compute the result and write it to a place. Raises OutputError."""
        self.FORM.write(place, self.run())


@dataclass(frozen=True, slots=True)
class Document(Generic[R]):
    """A result as a sealed JSON file that fits a schema.

    schema     a file of schemas/, with `#Name` for one of its definitions
    to_json    the result as values of JSON
    from_json  the result again, of content that fits the schema
    remedy     the user's next step where the file is damaged
    """

    schema: str
    to_json: Callable[[R], Mapping[str, Any]]
    from_json: Callable[[Mapping[str, Any]], R]
    remedy: str

    def is_whole(self, place: Path) -> bool:
        """Return whether the file fits its schema and its hash."""
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
    """Return the key of values of JSON."""
    text = json.dumps(content, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:_KEY_DIGITS]


def content_of(value: Any) -> Any:
    """Return a field as values of JSON, for a key.

    An object with a `key_content` counts by it: a source by its fingerprint, never by its path. A
    step counts by its own key. Raises TypeError for a path, as for all types that are not listed.
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
    raise TypeError(f"a key holds a {type(value).__name__}, expected plain values")
