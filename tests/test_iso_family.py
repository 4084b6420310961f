"""The default criterion on tiles whose solids are known, against scikit-image's thresholds."""

import numpy as np
import pytest

from bench.iso import PEERS, measure
from iso_family import Member, family


def _some() -> list[Member]:
    """A thirteenth of the family, of all kinds; `make bench-iso` takes all of it."""
    return list(family())[::13]


@pytest.mark.slow
def test_edges_find_more_of_the_solids_than_any_peer_and_are_never_the_last() -> None:
    members = _some()
    figures = [measure(member) for member in members]
    scores = {name: np.array([f[name][0] for f in figures]) for name in figures[0]}
    ours = scores["stereocell edges"]
    assert ours.mean() > max(scores[peer].mean() for peer in PEERS) + 0.05
    others = np.array([values for name, values in scores.items() if name != "stereocell edges"])
    for kind in ("balls", "tubes", "membranes"):
        of_kind = np.array([member.kind == kind for member in members])
        assert ours[of_kind].mean() > others[:, of_kind].mean(axis=1).min() + 0.1
