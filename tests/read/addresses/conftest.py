"""A service on loopback for each test."""

from collections.abc import Iterator

import pytest

from support.recorded_service import Service, serving


@pytest.fixture
def service() -> Iterator[Service]:
    with serving() as found:
        yield found


@pytest.fixture
def other_service() -> Iterator[Service]:
    with serving() as found:
        yield found
