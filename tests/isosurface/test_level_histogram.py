"""Levels from a histogram, on distributions whose levels are known."""

import numpy as np
import pytest
from numpy.typing import NDArray
from skimage.filters import threshold_li

from stereocell.isosurface.level_histogram import BINS, LevelHistogram, Scale

RNG = np.random.default_rng(1)


def scale_of(voxels: NDArray[np.generic]) -> Scale:
    return Scale.of(voxels, np.zeros(voxels.shape, bool))


def histogram_of(values: np.ndarray) -> LevelHistogram:
    values = values.astype(np.float32)
    scale = scale_of(values)
    return LevelHistogram(
        np.bincount(scale.bins_of(values), minlength=BINS).astype(np.float64), scale.edges()
    )


def test_bins_are_narrow_where_most_values_are_and_cover_all_values() -> None:
    usual = RNG.normal(100, 3, 100_000)
    values = np.concatenate([usual, [60_000.0] * 40]).astype(np.float32)
    scale = scale_of(values)
    edges, bins = scale.edges(), scale.bins_of(values)
    assert (np.diff(edges) > 0).all()
    assert edges[0] < values.min()
    assert edges[-1] > values.max()
    # Each value lies in its bin, or less than one fine step outside of it.
    step = (scale.high - scale.low) / 2**16
    assert (values > edges[bins] - step).all()
    assert (values < edges[bins + 1] + step).all()
    assert scale.bins_of(np.float32([-1e9, 1e9])).tolist() == [0, BINS - 1]
    histogram = histogram_of(values)
    assert histogram.width_at(100.0) < 2 < 100 < histogram.width_at(59_000.0)
    assert histogram.quantile(0.5) == pytest.approx(np.median(values), abs=1)


def test_li_s_threshold_is_scikit_image_s() -> None:
    values = np.concatenate([RNG.normal(100, 10, 90_000), RNG.normal(400, 60, 10_000)])
    # scikit-image subtracts the smallest value first, and we subtract a low quantile.
    assert histogram_of(values).li_threshold() == pytest.approx(threshold_li(values), rel=0.04)


def test_half_height_lies_between_two_heights_and_is_a_fixed_point() -> None:
    values = np.concatenate([RNG.normal(100, 10, 90_000), RNG.normal(400, 20, 10_000)])
    histogram = histogram_of(values)
    level = histogram.half_height()
    inside, outside = histogram.above(level).quantile(0.6), histogram.below(level).quantile(0.5)
    assert level == pytest.approx((inside + outside) / 2, abs=0.1)
    assert level == pytest.approx(250, rel=0.03)
    assert np.isnan(histogram_of(np.full(1000, 7.0)).half_height())


def test_valleys_lie_between_peaks_up_to_ten_times_apart_and_not_within_one_peak() -> None:
    dark = RNG.normal(100, 2, 900_000)
    dim, bright = RNG.normal(190, 8, 80_000), RNG.normal(1000, 60, 20_000)
    valleys = histogram_of(np.concatenate([dark, dim, bright])).find_valleys(2.0)
    assert len(valleys) == 2
    for valley, (low, high) in zip(valleys, [(106, 180), (215, 850)], strict=True):
        assert low < valley.value < high
        assert valley.low <= valley.value <= valley.high
        assert valley.dip < 0.5
    assert [v.peak for v in valleys] == pytest.approx([190, 1000], rel=0.05)
    for alone in (dark, RNG.exponential(10, 200_000), RNG.lognormal(4, 0.4, 200_000)):
        assert histogram_of(alone).find_valleys(float(alone.std()) / 3) == []
