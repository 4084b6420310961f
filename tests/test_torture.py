"""Some of what `make torture` does: one kill of each kind, at a random moment."""

from pathlib import Path

import pytest

from torture import KINDS, Torture


@pytest.mark.slow
def test_killed_in_every_way_a_build_goes_on_to_the_same_bytes(tmp_path: Path) -> None:
    torture = Torture(tmp_path, seed=3)
    for kind in KINDS:
        for _ in range(5):  # on a busy machine a build may end before its moment
            if torture.kill(kind):
                break
    torture.end()
    assert all(torture.outcomes[kind] for kind in KINDS)
    assert torture.outcomes["ended"] >= 1
