"""A source is settled before it is shown, while compiled code loads beside it."""

import time
from pathlib import Path

import pytest

from stereocell.live import first_look
from stereocell.live.first_look import FirstLook
from stereocell.planning.preset_choice import load_for
from support.phantoms import f_phantom, write_ome_tiff


def test_nothing_is_loaded_any_more_once_a_source_is_settled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """USD is imported next, and must meet no thread that loads a library: both would wait."""
    loaded: list[bool] = []

    def load() -> None:
        time.sleep(0.5)
        loaded.append(True)

    monkeypatch.setattr(first_look, "load_kernels", load)
    source = write_ome_tiff(tmp_path / "f.ome.tif", f_phantom(), spacing=(1.0, 0.5, 0.5))
    settings, choice = load_for(str(source), None, None, flags={})
    FirstLook.at(str(source), settings, choice)
    assert loaded == [True]
