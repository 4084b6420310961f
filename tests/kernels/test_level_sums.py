"""The sums on which levels are found, compared with numpy's."""

import numpy as np

from stereocell.isosurface.distance_field import gradient_magnitude
from stereocell.isosurface.level_evidence import (
    LAG,
    NOISE_BINS,
    Counting,
    gather_evidence,
    noise_edges,
)
from stereocell.isosurface.level_histogram import BINS, Scale
from stereocell.kernels.value_counts import count_values

OWN = (slice(1, 20), slice(1, 23), slice(4, 36))
SPACING = (0.5, 0.2, 0.2)


def test_sums_and_differences_equal_those_of_numpy() -> None:
    rng = np.random.default_rng(3)
    field = rng.gamma(2, 50, (21, 24, 40)).astype(np.float32)
    field[3, 4:9], field[5, 5, 5] = field[3, 4, 0], 1e6  # differences of 0, and one beyond all bins
    padding = np.zeros(field.shape, bool)
    padding[:, 18:, :9] = True
    scale = Scale(-20.0, 600.0, 90.0)
    found = gather_evidence(
        field,
        padding,
        OWN,
        voxels=field,
        spacing_um=SPACING,
        counting=Counting(scale, None, None),
    )
    slopes, values = gradient_magnitude(field, SPACING)[OWN].astype(np.float64), field[OWN]
    for sums, flags in ((found.plain, ~padding[OWN]), (found.padding, padding[OWN])):
        bins, steep = scale.bins_of(values[flags]), slopes[flags]
        np.testing.assert_array_equal(sums.counts, np.bincount(bins, minlength=BINS))
        np.testing.assert_allclose(sums.slopes, np.bincount(bins, steep, BINS), rtol=1e-12)
        squares = np.bincount(bins, (steep / 620) ** 2, BINS)
        np.testing.assert_allclose(sums.squares, squares, rtol=1e-6)

    ahead = (*OWN[:2], slice(4 + LAG, 36 + LAG))
    size = np.abs(field[ahead] - values)[~(padding[OWN] | padding[ahead])]
    edges = noise_edges(scale)
    counts, _ = np.histogram(np.clip(size, 0, edges[-1]), edges)
    assert len(counts) == NOISE_BINS
    np.testing.assert_array_equal(found.differences, counts)


def test_values_that_are_no_numbers_are_counted_in_the_first_bin() -> None:
    """Sources are read without such values, but a script may pass an array that has them."""
    field = np.full((6, 8, 30), 50.0, np.float32)
    field[2, 3, 7], field[3, 4, 9], field[4, 5, 11] = np.nan, np.inf, -np.inf
    scale, own = Scale(0.0, 100.0, 50.0), (slice(1, 5), slice(1, 7), slice(4, 26))
    found = gather_evidence(
        field,
        np.zeros(field.shape, bool),
        own,
        voxels=np.nan_to_num(field, posinf=0, neginf=0),
        spacing_um=SPACING,
        counting=Counting(scale, None, None),
    )
    counts = found.plain.counts
    assert (counts.sum(), counts[0], counts[-1]) == (field[own].size, 2, 1)
    assert found.differences.sum() == field[own].size


def test_a_histogram_without_width_has_all_values_in_one_bin() -> None:
    counts = np.zeros(4, np.int64)
    values, times = np.array([0.0, np.nan, 1.0]), np.ones(3, np.int64)
    count_values(values, times, np.zeros(5), 0.0, 0.0, False, counts)
    assert counts.sum() == 1
