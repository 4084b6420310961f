"""The stage that exports are made from: two tiles, a sphere across their border."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from pxr import Usd

from stereocell.storage.overwriting import forcing
from support.bundles import write_tiles
from support.stages import layer_over


@pytest.fixture(autouse=True)
def forced() -> Iterator[None]:
    """Let exports replace any file, because tests of one file's content write it several times."""
    with forcing(True):
        yield


@pytest.fixture(scope="session")
def sphere_stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A stage of the sphere, to be read only."""
    return write_tiles(tmp_path_factory.mktemp("stage"))


@pytest.fixture
def edited(sphere_stage: Path, tmp_path: Path) -> Callable[[Callable[[Usd.Stage], object]], Path]:
    """Write a layer over the stage: `edited(lambda stage: ...)`."""

    def write(change: Callable[[Usd.Stage], object]) -> Path:
        layer = layer_over(tmp_path / "edited.usda", str(sphere_stage))
        change(Usd.Stage.Open(layer))
        layer.Save()
        return tmp_path / "edited.usda"

    return write
