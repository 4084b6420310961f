"""A stage of two tiles, its bundle, and bundles of layers that edit it."""

import pytest

from support.bundles import write, write_tiles
from support.stages import edit_over


@pytest.fixture(scope="session")
def stage(tmp_path_factory):
    """The stage of two tiles; tests must not change it."""
    return write_tiles(tmp_path_factory.mktemp("stage"))


@pytest.fixture(scope="session")
def bundle(stage, tmp_path_factory):
    """The stage's bundle; tests must not change it."""
    out = tmp_path_factory.mktemp("bundle") / "bundle"
    write(stage, out)
    return out


@pytest.fixture
def edit(stage, tmp_path):
    """Return a function that writes a layer over the stage and returns the layer's bundle."""

    def export(change):
        path = edit_over(tmp_path / "edited.usda", stage, change)
        export.lines = write(path, tmp_path / "bundle")
        return tmp_path / "bundle"

    return export
