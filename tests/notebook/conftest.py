"""A bundle of two tiles, and the widget that shows it."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from stereocell.bundle import blob_page
from stereocell.engine.run import Engine
from stereocell.notebook import page
from support.bundles import write_bundle, write_tiles


@pytest.fixture(scope="session")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bundle by itself, to be read only."""
    folder = tmp_path_factory.mktemp("notebook")
    stage = write_tiles(folder / "stage")
    write_bundle(stage, folder / "bundle", None, engine=Engine(0))
    return folder / "bundle"


@pytest.fixture
def built_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of a page of two files, for a checkout whose viewer is not built."""
    folder = tmp_path / "dist"
    (folder / "assets").mkdir(parents=True)
    for name, content in {
        "index.html": "",
        "assets/index-1.css": "style",
        "assets/viewer-1.js": "plain",
        "assets/viewer-1.js.gz": "packed",
        "assets/viewer-1.js.br": "other",
    }.items():
        (folder / name).write_text(content)
    monkeypatch.setattr(blob_page, "viewer_dist", lambda: folder)
    blob_page.files.cache_clear()
    page.key.cache_clear()
    yield folder
    blob_page.files.cache_clear()
    page.key.cache_clear()
