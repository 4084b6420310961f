"""Run tasks with OUT on object storage: each worker opens it and returns a list of its uploads."""

import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from stereocell.storage.claim import Claim, held, working_for
from stereocell.storage.object_store import Place, Size
from stereocell.storage.workspace import forget, joined, opened_here

T = TypeVar("T")
R = TypeVar("R")

_working = threading.Lock()  # lets a worker with several threads run one task at a time


@dataclass(frozen=True, slots=True)
class _Carried(Generic[T, R]):
    """A function that opens OUT on any machine, and returns its result and its uploads."""

    function: Callable[[T], R]
    place: Place
    claim: bytes

    def __call__(self, task: T) -> tuple[R, dict[str, Size]]:
        with _working:
            mirror = joined(self.place, self.claim)
            mirror.news.clear()
            return self.function(task), dict(mirror.news)


@dataclass(frozen=True, slots=True)
class _Asked(Generic[T, R]):
    """A function that may write into a folder only while the command that claimed it runs."""

    function: Callable[[T], R]
    claim: Claim

    def __call__(self, task: T) -> R:
        with working_for(self.claim):
            return self.function(task)


def carried(function: Callable[[T], R]) -> tuple[Callable[[T], Any], Callable[[Any], R]]:
    """Return a function for workers to run instead, and a function that unpacks its result."""
    mirror = opened_here()
    if mirror is None:
        claim = held()
        return function if claim is None else _Asked(function, claim), lambda result: result

    def settle(answer: tuple[R, dict[str, Size]]) -> R:
        result, news = answer
        mirror.learn(news)
        return result

    return _Carried(function, mirror.place, mirror.claim), settle


def forget_scratch(client: Any) -> None:
    """Remove the working folders on a cluster's workers."""
    mirror = opened_here()
    if mirror is not None:
        with suppress(Exception):  # the cluster may be gone
            client.run(forget, mirror.place.root)
