"""A little of what `make torture` does: a kill at a random moment.

Of the command alone tells test_resume.py too, of a session test_mirror.py, of a worker
test_engine.py.
"""

from pathlib import Path

import pytest

from torture import Folder, Torture


@pytest.mark.slow
def test_killed_at_any_moment_a_build_goes_on_to_the_same_bytes(tmp_path: Path) -> None:
    torture = Torture(tmp_path, Folder(tmp_path / "out"), seed=3)
    assert any(torture.kill("scheduler") for _ in range(5))  # unless it ends before its moment
    torture.end()
    assert torture.outcomes["ended"] >= 1
