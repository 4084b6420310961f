"""The default criterion on tiles whose solids are known, against scikit-image's thresholds."""

import numpy as np
import pytest

from bench.iso import PEERS, find_solids
from support.exhaustive import IS_EXHAUSTIVE
from support.iso_value_family import Member, dice, family


def _some() -> list[Member]:
    """A seventh of the family, of all kinds, or less; `make bench-iso` takes all of it."""
    return list(family())[:: 7 if IS_EXHAUSTIVE else 11]


@pytest.mark.slow
def test_edges_find_more_of_the_solids_than_any_peer_and_are_never_the_last() -> None:
    members = _some()
    scores: dict[str, list[float]] = {}
    for member in members:
        truth, found = find_solids(member)
        for name, solids in found.items():
            scores.setdefault(name, []).append(dice(solids, truth))
    ours = np.array(scores["stereocell edges"])
    assert ours.mean() > max(np.mean(scores[peer]) for peer in PEERS) + 0.05
    others = np.array([values for name, values in scores.items() if name != "stereocell edges"])
    for kind in ("balls", "tubes", "membranes"):
        of_kind = np.array([member.kind == kind for member in members])
        assert ours[of_kind].mean() > others[:, of_kind].mean(axis=1).min() + 0.1
