"""A service on loopback for each test, without the answers of other tests."""

from collections.abc import Iterator

import pytest

from stereocell.read.addresses import resolve as module
from support.recorded_service import Service, serving


@pytest.fixture
def service() -> Iterator[Service]:
    with serving() as found:
        yield found


@pytest.fixture
def other_service() -> Iterator[Service]:
    with serving() as found:
        yield found


@pytest.fixture(autouse=True)
def forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_known", {})
