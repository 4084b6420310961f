"""A small part of `make torture`: kills in phases whose results come together last.

test_resume.py also interrupts the command alone, and engine/test_run.py kills a worker.
"""

from pathlib import Path

import pytest

from support.exhaustive import sweep
from support.torture import KINDS, PHASES, Folder, Torture, kills_of

SESSION = {"session": "stage"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kills", "workers"),
    # With one worker, killing all processes differs from killing the command only in its time.
    sweep([(SESSION, 1), (SESSION | {"scheduler": "bundle"}, 2)], kept=[(SESSION, 1)]),
)
def test_killed_at_any_moment_a_build_goes_on_to_the_same_bytes(
    tmp_path: Path, kills: dict[str, str], workers: int
) -> None:
    torture = Torture(tmp_path, Folder(tmp_path / "out"), seed=3, workers=workers)
    for kind, phase in kills.items():
        torture.kill_in(kind, phase)
    torture.end()
    assert all(torture.outcomes[kind] for kind in kills)
    assert all(torture.phases[phase] for phase in kills.values())
    assert torture.outcomes["ended"] >= 1


def test_kills_are_spread_evenly_over_phases_places_and_kinds() -> None:
    kills = list(kills_of(60, ["folder", "bucket"]))
    for place in ("folder", "bucket"):
        for phase in PHASES:
            kinds = [k for p, k, f in kills if (p, f) == (place, phase)]
            assert len(kinds) == 5
            assert set(kinds) == set(KINDS) - ({"worker"} if phase == "plan" else set())
