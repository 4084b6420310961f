"""The stage that exports are made from: two tiles, a sphere across their border."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest
from pxr import Usd

from stereocell.storage.overwriting import forcing
from support.bundles import write_tiles
from support.stages import edit_over


@pytest.fixture(autouse=True)
def forced() -> Iterator[None]:
    """Let exports replace any file, because tests write the same file several times."""
    with forcing(True):
        yield


@pytest.fixture(scope="session")
def sphere_stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A stage of the sphere; tests must not change it."""
    return write_tiles(tmp_path_factory.mktemp("stage"))


@pytest.fixture
def edited(sphere_stage: Path, tmp_path: Path) -> Callable[[Callable[[Usd.Stage], object]], Path]:
    """Return a function that writes a layer over the stage: `edited(lambda stage: ...)`."""

    return partial(edit_over, tmp_path / "edited.usda", sphere_stage)
