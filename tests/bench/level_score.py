"""Compare a scored choice of the level with a sequence of tests, holding out one source at a time.

Every level has six features, and a logistic function of them gives the probability that the level
is right. The function is fitted on the volumes of all other sources, so no volume judges itself.
docs/decisions/levels.md has the results.
"""

import os
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from iso import dice
from numpy.typing import NDArray
from scipy import optimize

sys.path.insert(0, str(Path(__file__).parents[1]))
from machine import stated

from corpus import all_cases
from corpus.level_search import search_levels
from stereocell.isosurface import level as bounds
from stereocell.isosurface.level import Level, clear_of

FEATURES = ("order", "valley", "separation", "slope beside", "apart from noise", "weakest bound")
RIGHT = 0.7  # Dice from which a level counts as right
RIDGE = 0.003  # penalty on the square of a standardised coefficient
THRESHOLDS = (0.3, 0.4, 0.5, 0.55, 0.6)
Array = NDArray[np.float64]


@dataclass(frozen=True)
class VolumeLevels:
    """The candidate iso-values ("levels") of one volume.

    source    volumes of one source are held out together
    features  float64 (levels, 6)
    dice      Dice of each level with the truth; 0 for empty volumes
    tree      index of the level that the sequence of tests chooses; None: no surface
    likely    indices of the clear levels, and of nearly clear levels outside of these
    """

    name: str
    source: str
    is_empty: bool
    features: Array
    dice: Array
    tree: int | None
    likely: tuple[int, ...]


def measure(number: int) -> VolumeLevels:
    """Return the levels of one case of the corpus."""
    case = list(all_cases())[number]
    search = search_levels(case)
    levels, shown = search.found.all_levels, search.found.shown()
    if clear_of(levels) and not shown:
        levels = ()  # the tests rule out noise or uneven light, so no level may be chosen
    clear = [k for k, level in enumerate(levels) if level in shown]
    scores = [
        0.0 if search.truth is None else dice(search.values > level.value, search.truth)
        for level in levels
    ]
    near = [k for k, level in enumerate(levels) if clear and k < clear[0] and level.is_nearly_clear]
    rows = [_features(level, place) for place, level in enumerate(levels)]
    kind = case.name.split(",")[0] if case.source == "made" else case.source
    return VolumeLevels(
        case.name,
        kind,
        case.group == "empty",
        np.array(rows).reshape(len(rows), len(FEATURES)),
        np.array(scores),
        clear[0] if clear else None,
        tuple(near + clear),
    )


def _features(level: Level, place: int) -> list[float]:
    """Return the features of a level, within bounds; steep ones are logarithms."""
    apart = max(
        (bounds.DIP - level.dip) / 0.2,
        (level.separation - bounds.MIN_SEPARATION) / 0.03,
        float(np.log(max(level.steepness, 1e-3) / bounds.MIN_STEEPNESS)) / 0.3,
    )
    weakest = min(
        level.snr / bounds.MIN_SNR, level.sharpness / bounds.MIN_SHARPNESS,
        level.rise / bounds.MIN_RISE,
    )  # fmt: skip
    return [
        min(place, 2),
        1 - min(level.dip, 1.0),
        level.separation,
        float(np.log(np.clip(level.rise, 1, 8))),
        float(np.clip(apart, -3, 3)),
        float(np.clip(np.log(max(weakest, 0.1)), -2, 2)),
    ]


def fit(volumes: Sequence[VolumeLevels]) -> Array:
    """Return the intercept and a coefficient for each feature, of a logistic function."""
    known = [one for one in volumes if len(one.dice)]
    features = np.vstack([one.features for one in known])
    right = np.concatenate(
        [(one.dice >= RIGHT) & (one.dice >= one.dice.max() - 0.05) for one in known]
    )
    weights = np.concatenate([np.full(len(one.dice), 1 / len(one.dice)) for one in known])
    mean, spread = features.mean(0), features.std(0) + 1e-9
    design = np.c_[np.ones(len(features)), (features - mean) / spread]

    def loss(b: Array) -> float:
        wrong = np.logaddexp(0, -(2.0 * right - 1) * (design @ b))
        return float(np.average(wrong, weights=weights) + RIDGE * (b[1:] ** 2).sum())

    b = optimize.minimize(loss, np.zeros(design.shape[1])).x
    return np.r_[b[0] - (b[1:] * mean / spread).sum(), b[1:] / spread]


def score(b: Array, features: Array) -> Array:
    return np.asarray(1 / (1 + np.exp(-(b[0] + features @ b[1:]))))


def main() -> None:
    """Print the table."""
    cases = [
        k for k, case in enumerate(all_cases())
        if case.level == 0 and case.group not in ("looked at", "nested")
    ]  # fmt: skip
    with ProcessPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        volumes = list(pool.map(measure, cases))
    held_out = {}
    for source in {one.source for one in volumes}:
        b = fit([one for one in volumes if one.source != source])
        held_out |= {one.name: score(b, one.features) for one in volumes if one.source == source}
    print("| choice | real volumes | made ones | surface on nothing |\n|---|---|---|---|")
    _print("tests in a row", volumes, lambda one: one.tree)
    for least in THRESHOLDS:
        _print(
            f"best score, if {least:g} or more", volumes,
            lambda one, least=least: _best(held_out[one.name], range(len(one.dice)), least),
        )  # fmt: skip
    _print(
        "best score of the clear and nearly clear", volumes,
        lambda one: _best(held_out[one.name], one.likely, 0.0),
    )  # fmt: skip
    _print(
        "best level by the truth", volumes, lambda one: _best(one.dice, range(len(one.dice)), 0.01)
    )
    coefficients = dict(zip(("intercept", *FEATURES), fit(volumes).round(2).tolist(), strict=True))
    print(f"\nfitted on all: {coefficients}")


def _best(scores: Array, allowed: Sequence[int], least: float) -> int | None:
    if not len(allowed):
        return None
    best = max(allowed, key=lambda place: scores[place])
    return best if scores[best] >= least else None


def _print(
    name: str, volumes: Sequence[VolumeLevels], choose: Callable[[VolumeLevels], int | None]
) -> None:
    real, made, empty = [], [], 0
    kinds = {case.name for case in all_cases() if case.source == "made"}
    for one in volumes:
        place = choose(one)
        if one.is_empty:
            empty += place is not None
        else:
            (made if one.name in kinds else real).append(0.0 if place is None else one.dice[place])
    count = sum(one.is_empty for one in volumes)
    print(
        f"| {name} | {np.mean(real):.3f} of {len(real)} | {np.mean(made):.3f} of {len(made)} | "
        f"{empty} of {count} |"
    )


if __name__ == "__main__":
    with stated():
        main()
