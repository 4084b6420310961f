"""The default criterion on tiles whose solids are known, against scikit-image's thresholds."""

from collections.abc import Callable

import numpy as np
import pytest
from skimage import filters

from stereocell.filters.background import find_background
from stereocell.filters.denoise import denoise, smooth
from stereocell.isosurface.isovalue import find_iso_value
from stereocell.isosurface.options import BY_TILE, IsoValueOptions
from stereocell.model.tiling import Box
from stereocell.model.volume import Volume
from support.exhaustive import IS_EXHAUSTIVE
from support.iso_value_family import SHAPE, SPACING, Mask, Member, dice, family, make

SIGMA_UM = 0.14  # as `auto` has it: the finest spacing
PEERS: dict[str, Callable[[np.ndarray], float]] = {
    "Otsu": filters.threshold_otsu,
    "Li": filters.threshold_li,
    "isodata": filters.threshold_isodata,
}


def find_solids(member: Member) -> tuple[Mask, dict[str, Mask]]:
    """Return the solids of one member, and what every criterion and peer finds of them."""
    truth, counts = make(member, seed=0)
    volume, region = Volume(counts, SPACING), Box((0, 0, 0), SHAPE)
    under = find_background(counts, region, spacing_um=SPACING, block_um=64 * SIGMA_UM)
    plain, ours = smooth(volume, SIGMA_UM), denoise(volume, SIGMA_UM) - under.at(region)
    found = {name: plain > peer(plain) for name, peer in PEERS.items()}
    found |= {f"{name}, background subtracted": ours > peer(ours) for name, peer in PEERS.items()}
    for criterion in BY_TILE:
        options = IsoValueOptions(criterion=criterion)
        found[f"stereocell {criterion}"] = ours > find_iso_value(ours, SPACING, options).value
    return truth, found


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
