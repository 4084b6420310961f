"""Find noise and materials in a histogram of value and gradient (transfer/joint_histogram.py).

Inside a material the gradient is only noise, the length of a vector of three noisy differences, and
many voxels have the same value. So the modes of the gradients show the noise. The materials are the
peaks of the values, among voxels with gradients no larger than noise.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

NOISE_FACTOR = 1.9  # multiple of the gradients' mode; 93 % of such a vector's lengths lie below
BRIGHT = 0.3  # value, 0..1, above which noise that rises with the value is looked for
RISING_PERCENTILE = 10.0  # percent of the columns that may rise less than the noise
FLAT_STEP = 3.0 / 255  # least noise, where values are 0..1: rounding to 8 bits and a slow drift
MIN_IN_COLUMN = 2e-5  # least share of all voxels in a column whose mode is used
MIN_SHARE = 0.004  # least share of a material in the voxels whose gradient is only noise
MIN_PROMINENCE = 0.2  # least prominence divided by the peak's height; a shoulder is not a material
MAX_MATERIALS = 6  # largest number of materials of a channel


def find_noise(counts: NDArray[np.int64], gradient_max: float) -> NDArray[np.float64]:
    """Return, for each column, the gradient below which it may be noise.

    counts        int64 (rows, columns), voxels by gradient and value, both from 0 up
    gradient_max  gradient magnitude of the last row
    result        float64 (columns,), shares of `gradient_max`, 0..1

    The noise follows from the mode of each column's gradients. The median of the modes over the
    voxels is the floor, because most voxels lie inside a material. Columns at the window's ends are
    left out, because clipping reduces their noise. Photon noise grows with brightness. So a rise of
    the squared modes in proportion to the value, found in nearly all columns, also counts as noise.
    """
    rows, columns = counts.shape
    inner = counts.copy()
    if counts[:, 1:-1].any():
        inner[:, [0, -1]] = 0
    sums = inner.sum(axis=0)
    modes = ndimage.gaussian_filter(inner.astype(np.float64), (0.7, 2.0), mode="nearest").argmax(0)
    weight = np.cumsum(np.bincount(modes, sums, rows))
    floor = float(np.searchsorted(weight, weight[-1] / 2)) / (rows - 1)
    values = np.linspace(0, 1, columns)
    rising = (values >= BRIGHT) & (sums >= max(8, MIN_IN_COLUMN * sums.sum()))
    slope = 0.0
    if rising.any():
        above = (modes[rising] / (rows - 1)) ** 2 - floor**2
        slope = max(0.0, float(np.percentile(above / values[rising], RISING_PERCENTILE)))
    level = NOISE_FACTOR * np.sqrt(floor**2 + slope * values)
    return np.clip(level, FLAT_STEP / gradient_max, 1.0)


def find_materials(counts: NDArray[np.int64], noise: NDArray[np.float64]) -> tuple[float, ...]:
    """Return the values of the materials, 0..1, rising.

    counts  int64 (rows, columns), voxels by gradient and value
    noise   float64 (columns,), from `find_noise`
    """
    rows, columns = counts.shape
    is_flat = np.arange(rows)[:, np.newaxis] <= noise * (rows - 1)
    flat = np.where(is_flat, counts, 0).sum(axis=0).astype(np.float64)
    if flat.sum() == 0:
        return ()
    # A source with few values leaves gaps between the columns.
    sigma = max(2.0, column_gap(counts))
    pad = int(4 * sigma) + 2  # a peak may lie at an end of the window
    smooth = ndimage.gaussian_filter1d(np.pad(flat, pad), sigma, mode="constant")
    candidates = []
    for peak in find_peaks(smooth):
        left, right = bases_of(smooth, peak)
        prominence = smooth[peak] - max(smooth[left], smooth[right])
        if prominence < MIN_PROMINENCE * smooth[peak]:
            continue
        low, high = _foot(smooth, peak, left, right)
        mass = smooth[low : high + 1].sum()
        if mass >= MIN_SHARE * flat.sum():
            candidates.append((float(mass), _centre(smooth, peak, low, high) - pad))
    heaviest = sorted(candidates, reverse=True)[:MAX_MATERIALS]
    return tuple(sorted(float(np.clip(place / (columns - 1), 0, 1)) for _, place in heaviest))


def find_peaks(curve: NDArray[np.float64]) -> list[int]:
    """Return where a curve is higher than on both sides; for a plateau, its middle.

    curve  float64 (columns,)

    The result equals that of `scipy.signal.find_peaks`. Importing that takes a second, for which
    every command and worker of a build would wait.
    """
    starts = np.flatnonzero(np.concatenate([[True], np.diff(curve) != 0]))
    ends = np.append(starts[1:], len(curve)) - 1
    heights = curve[starts]
    is_peak = np.zeros(len(starts), bool)
    is_peak[1:-1] = (heights[1:-1] > heights[:-2]) & (heights[1:-1] > heights[2:])
    return [int(middle) for middle in (starts[is_peak] + ends[is_peak]) // 2]


def bases_of(curve: NDArray[np.float64], peak: int) -> tuple[int, int]:
    """Return the lowest columns on both sides of a peak, up to where the curve exceeds the peak.

    curve  float64 (columns,)

    The nearest of equally low columns is returned, as by `scipy.signal.peak_prominences`.
    """
    higher = np.flatnonzero(curve > curve[peak])
    start = higher[higher < peak].max(initial=-1) + 1
    end = higher[higher > peak].min(initial=len(curve))
    left = peak - int(curve[start : peak + 1][::-1].argmin())
    return left, peak + int(curve[peak:end].argmin())


def column_gap(counts: NDArray[np.int64]) -> float:
    """Return the mean distance between the columns that hold voxels, in columns.

    counts  int64 (rows, columns)
    """
    held = np.flatnonzero(counts.any(axis=0))
    return float(held[-1] - held[0]) / max(1, len(held) - 1) if len(held) else 1.0


def _foot(smooth: NDArray[np.float64], peak: int, left: int, right: int) -> tuple[int, int]:
    """Return the columns at which a peak falls to half of its height, within its bases."""
    low = high = peak
    while low > left and smooth[low - 1] > 0.5 * smooth[peak]:
        low -= 1
    while high < right and smooth[high + 1] > 0.5 * smooth[peak]:
        high += 1
    return low, high


def _centre(smooth: NDArray[np.float64], peak: int, low: int, high: int) -> float:
    """Return the centre of a peak's upper half, over the same distance on both sides."""
    reach = min(peak - low, high - peak) if peak not in (low, high) else 0
    part = np.arange(peak - reach, peak + reach + 1)
    return float(np.average(part, weights=smooth[part]))
