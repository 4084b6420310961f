"""The states of an input's files: folders, links, and files that vanish in the meantime."""

import os
from pathlib import Path
from typing import Any

import pytest

from stereocell.storage.file_states import FileStates
from stereocell.storage.location import Location


def names_of(folder: Path) -> set[str]:
    return {Path(path).name for path in FileStates.look(Location.of(folder), [str(folder)]).states}


def test_files_of_a_folder_are_found_and_links_to_folders_are_not_followed(tmp_path: Path) -> None:
    folder = tmp_path / "volume"
    (folder / "0").mkdir(parents=True)
    (folder / "0" / "chunk").write_bytes(b"voxels")
    (tmp_path / "elsewhere").write_bytes(b"voxels")
    (folder / "to a file").symlink_to(tmp_path / "elsewhere")
    (folder / "to nothing").symlink_to(tmp_path / "missing")
    (folder / "to itself").symlink_to(folder)
    assert names_of(folder) == {"chunk", "to a file"}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no named pipes")
def test_a_named_pipe_is_not_opened(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "chunk").write_bytes(b"voxels")
    assert names_of(tmp_path) == {"chunk"}


@pytest.mark.parametrize("listing", ["listdir", "scandir"])
def test_a_file_that_vanishes_after_its_folder_was_listed_counts_as_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, listing: str
) -> None:
    (tmp_path / "a folder").mkdir()
    for name in ("a folder/chunk", "b", "c"):
        (tmp_path / name).write_bytes(b"voxels")
    states = FileStates.look(Location.of(tmp_path), [str(tmp_path)])
    list_folder = getattr(os, listing)

    def remove_a_sibling(path: Any) -> Any:
        if str(path).endswith("a folder"):
            (tmp_path / "b").unlink()
        return list_folder(path)

    monkeypatch.setattr(os, listing, remove_a_sibling)
    states.changed()
    monkeypatch.undo()
    (tmp_path / "b").unlink(missing_ok=True)
    assert [Path(path).name for path in states.changed()] == ["b"]
