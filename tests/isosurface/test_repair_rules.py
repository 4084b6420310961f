"""Lengths for a channel's repair, by the first paper's rule on the components in all its tiles."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.isosurface.components import find_components
from stereocell.isosurface.extract import extract_surface
from stereocell.isosurface.repair import repair
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.isosurface.repair_rules import sum_components
from stereocell.model.lattice import Lattice
from stereocell.model.tiling import Box
from stereocell.planning.plan import Plan
from stereocell.read import Level
from support.plans import CHANNELS, choose, plan_of

SPACING = (0.5, 0.25, 0.25)
SHAPE = (40, 80, 120)
RADII = {(5.0, 5.0, 5.0): 3.0, (10.0, 12.0, 14.0): 4.0, (16.0, 15.0, 25.0): 1.2}


def _distance() -> NDArray[np.float32]:
    """Return the distance to three balls, um."""
    places = [i * h for i, h in zip(np.indices(SHAPE), SPACING, strict=True)]
    away = [
        np.sqrt(sum((p - c) ** 2 for p, c in zip(places, centre, strict=True))) - radius
        for centre, radius in RADII.items()
    ]
    return np.clip(-np.minimum.reduce(away), -1, 1).astype(np.float32)


def test_face_counts_equal_those_of_the_extracted_surface() -> None:
    distance, whole = _distance(), Box((0, 0, 0), SHAPE)
    components = find_components(distance > 0, SPACING, 26)
    mesh = extract_surface(distance, Lattice.of_whole(whole, SPACING))
    assert len(components.diagonal_um) == len(RADII)
    # Each ball has twice as many triangles as vertices, less four.
    assert components.faces().sum() - 4 * len(RADII) == len(mesh.triangles)
    for diagonal, radius in zip(
        sorted(components.diagonal_um), sorted(RADII.values()), strict=True
    ):
        assert diagonal == pytest.approx(2 * 3**0.5 * radius, rel=0.2)
    assert components.whole.all()


def test_small_ball_is_under_half_of_the_means_and_is_dropped() -> None:
    distance = _distance()
    sums = sum_components(distance > 0, SPACING, 1.0)
    assert (sums.count, sums.kept) == (3, 2)
    options = choose(_plan_with(max_fragment_um=4.0), [asdict(sums)])
    dropped = repair(distance, SPACING, options=options)
    assert dropped.fragments_dropped == 1
    assert dropped.distance[32, 60, 100] < 0  # centre of the small ball
    assert dropped.distance[10, 20, 20] > 0


def test_fragments_longer_than_the_limit_stay_and_a_limit_of_zero_keeps_all() -> None:
    sums = asdict(sum_components(_distance() > 0, SPACING, 1.0))
    # The small ball is larger than the fragments that a unit is certain to see completely.
    for length in (3.0, 0.0):
        options = choose(_plan_with(max_fragment_um=length), [sums])
        assert repair(_distance(), SPACING, options=options).fragments_dropped == 0
        assert options.min_diagonal_um <= max(1.5, length)


def test_specks_do_not_affect_the_means() -> None:
    rng = np.random.default_rng(0)
    inside = _distance() > 0
    specks = inside | (rng.random(SHAPE) > 0.999)
    assert sum_components(specks, SPACING, 1.5).count == sum_components(inside, SPACING, 1.5).count
    assert sum_components(np.zeros(SHAPE, bool), SPACING, 1.5).count == 0


def test_alpha_is_shorter_for_noisy_solids_and_stays_in_its_bounds() -> None:
    plan = _plan_with(max_alpha_um=2.0)
    plain = {"count": 4, "faces": 4 * 4000, "diagonal_um": 4 * 12.0}
    plain |= {"kept": 4, "kept_faces": 4 * 4000, "kept_diagonal_um": 4 * 12.0}
    alpha = choose(plan, [plain]).alpha_um
    assert alpha == pytest.approx(6 * 12 / 4000**0.5)
    # Sums over two tiles give the same alpha.
    halves = [{key: value / 2 for key, value in plain.items()}] * 2
    assert choose(plan, halves).alpha_um == pytest.approx(alpha)
    noisy = plain | {"kept_faces": 4 * 10_000}
    assert choose(plan, [noisy]).alpha_um == pytest.approx(6 * 12 / 100)
    assert choose(plan, [plain | {"kept_faces": 10**9}]).alpha_um == 0.5
    assert choose(plan, [plain | {"kept_faces": 4}]).alpha_um == 2.0
    assert choose(plan, []).alpha_um == 2.0


def test_a_solid_that_fills_its_tile_has_no_faces_and_does_not_affect_alpha() -> None:
    sums = asdict(sum_components(np.ones((8, 9, 10), bool), SPACING, 1.0))
    assert (sums["kept"], sums["kept_faces"]) == (1, 0)
    assert choose(_plan_with(max_alpha_um=2.0), [sums]).alpha_um == 2.0


def test_given_lengths_are_used_and_offset_may_follow_alpha() -> None:
    assert choose(_plan_with(alpha_um=0.8), []).alpha_um == 0.8
    assert choose(_plan_with(alpha_um=0.8), []).offset_um == 0.0
    tenth = choose(_plan_with(alpha_um=0.8, offset_um="auto"), []).offset_um
    assert tenth == pytest.approx(0.08)
    assert choose(_plan_with(alpha_um=0.8, offset_um=0.3), []).offset_um == 0.3


def test_offset_moves_the_surface_outward_and_restores_no_fragment() -> None:
    distance = _distance()
    options = RepairOptions(0.0, 5.0, 0.0, offset_um=0.3)
    moved = repair(distance.copy(), SPACING, options=options)
    assert moved.fragments_dropped == 1
    whole = Box((0, 0, 0), SHAPE)
    mesh = extract_surface(moved.distance, Lattice.of_whole(whole, SPACING))
    x, y, z = mesh.positions.T
    away = [
        np.sqrt((z - c) ** 2 + (-y - b) ** 2 + (x - a) ** 2) - radius
        for (c, b, a), radius in RADII.items()
        if radius > 2
    ]
    np.testing.assert_allclose(np.minimum.reduce(away), 0.3, atol=0.03)
    without = repair(distance, SPACING, options=replace(options, min_diagonal_um=0.0))
    assert without.distance[32, 60, 100] > 0


def _plan_with(**surface: object) -> Plan:
    return plan_of(levels=(Level(SHAPE, SPACING),), channels=CHANNELS[:1], surface=surface)
