"""Folders of fetched files are removed after their process ends, even if it was killed."""

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from stereocell.read.addresses import fetched_folder

MAKE = (
    "import sys; from stereocell.read.addresses.fetched_folder import new_folder;"
    "folder = new_folder('dicom'); (folder / 'a.dcm').write_text('x');"
    "print(folder, flush=True);"
)


@pytest.fixture
def scratch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_a_folder_is_private_and_can_be_removed_at_once(scratch: Path) -> None:
    folder = fetched_folder.new_folder("dicom")
    assert folder.parent.parent == scratch
    assert (folder.stat().st_mode | folder.parent.stat().st_mode) & 0o77 == 0
    fetched_folder.remove(folder)
    assert os.listdir(scratch) == []


@pytest.mark.parametrize("end", ["", "raise SystemExit(1)", "raise KeyboardInterrupt"])
@pytest.mark.slow
def test_a_folder_is_removed_when_its_process_ends(scratch: Path, end: str) -> None:
    done = subprocess.run([sys.executable, "-c", MAKE + end], capture_output=True, text=True)
    assert Path(done.stdout.strip()).name == "dicom"
    assert os.listdir(scratch) == []


@pytest.mark.slow
def test_a_forked_child_does_not_remove_the_folder(scratch: Path) -> None:
    fork = "import os; p = os.fork(); p or sys.exit(0); os.waitpid(p, 0); print(folder.exists())"
    done = subprocess.run(
        [sys.executable, "-c", MAKE + fork], capture_output=True, text=True, check=True
    )
    assert done.stdout.split()[1] == "True"
    assert os.listdir(scratch) == []


@pytest.mark.slow
def test_the_folder_of_a_killed_process_is_removed_by_the_next_one(scratch: Path) -> None:
    sleep = "import time; time.sleep(60)"
    with subprocess.Popen(
        [sys.executable, "-c", MAKE + sleep], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        killed = Path(process.stdout.readline().strip())
        (scratch / "stereocell-fetched-other").mkdir()  # another process is making it
        fetched_folder.remove(fetched_folder.new_folder("dicom"))
        assert (killed / "a.dcm").exists()  # its process is running
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert killed.exists()
    fetched_folder.remove(fetched_folder.new_folder("dicom"))
    assert os.listdir(scratch) == ["stereocell-fetched-other"]


def test_links_to_other_folders_are_not_followed(scratch: Path) -> None:
    mine = scratch / "mine"
    mine.mkdir()
    (mine / ".lock").touch()
    (scratch / "stereocell-fetched-evil").symlink_to(mine)
    fetched_folder.remove(fetched_folder.new_folder("dicom"))
    assert (mine / ".lock").exists()
