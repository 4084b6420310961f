"""Peaks and their bases, compared with those of scipy, which the pipeline does not import."""

import numpy as np
import pytest
from scipy import signal

from stereocell.transfer.material_peaks import bases_of, find_peaks


@pytest.mark.parametrize("levels", [4, 40, 4_000_000])
def test_peaks_and_bases_equal_those_of_scipy(levels: int) -> None:
    random = np.random.default_rng(levels)
    for size in [1, 2, 3, 5, *random.integers(6, 300, 200)]:
        curve = np.cumsum(random.integers(-3, 4, size)).astype(float)  # with plateaus
        if levels > 40:
            curve += random.random(size)  # without plateaus
        curve %= levels  # with cliffs
        peaks, found = signal.find_peaks(curve, prominence=0)
        assert find_peaks(curve) == peaks.tolist()
        bases = [bases_of(curve, peak) for peak in find_peaks(curve)]
        assert [left for left, _ in bases] == found["left_bases"].tolist()
        assert [right for _, right in bases] == found["right_bases"].tolist()
