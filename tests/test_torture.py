"""A little of what `make torture` does: two kills at random moments.

Of the command alone tells test_resume.py too, of a worker test_engine.py.
"""

from pathlib import Path

import pytest

from torture import Folder, Torture

KINDS = ("session", "scheduler")


@pytest.mark.slow
def test_killed_at_any_moment_a_build_goes_on_to_the_same_bytes(tmp_path: Path) -> None:
    torture = Torture(tmp_path, Folder(tmp_path / "out"), seed=3)
    for kind in KINDS:
        for _ in range(5):  # on a busy machine a build may end before its moment
            if torture.kill(kind):
                break
    torture.end()
    assert all(torture.outcomes[kind] for kind in KINDS)
    assert torture.outcomes["ended"] >= 1
