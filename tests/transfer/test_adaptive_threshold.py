"""The adaptive binarisation threshold, on histograms whose valleys are known."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from scipy.optimize import minimize_scalar
from scipy.stats import norm
from skimage import filters

from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.isosurface.level_evidence import Counting
from stereocell.isosurface.level_histogram import Scale
from stereocell.model.channel import SurfaceLevel
from stereocell.report.thresholds import describe, draw_threshold, find_peers
from stereocell.report.unit_pictures import draw_cut
from stereocell.steps.find_window import Window, window_from_json, window_to_json
from stereocell.transfer.adaptive_threshold import (
    Histogram,
    Threshold,
    count_in_bins,
    find_adaptive_threshold,
    make_histogram,
    smooth,
)
from stereocell.transfer.channel_statistics import (
    find_statistics,
    make_appearance,
)
from stereocell.transfer.opacity import THRESHOLD, evaluate
from stereocell.transfer.options import WindowOptions
from stereocell.verify.formats import check
from support import phantoms

BINS = 256
AT = np.arange(BINS) + 0.5


def bell(center: float, sigma: float, height: float) -> NDArray[np.float64]:
    return np.asarray(height * np.exp(-(((AT - center) / sigma) ** 2) / 2))


def histogram(counts: NDArray[np.float64], low: float = 0.0, high: float = BINS) -> Histogram:
    return Histogram(tuple(np.rint(counts).astype(int).tolist()), low, high)


def found(counts: NDArray[np.float64]) -> Threshold:
    threshold = find_adaptive_threshold(histogram(counts))
    assert threshold is not None
    return threshold


def valley(bells: list[tuple[float, float, float]], low: float, high: float) -> float:
    """Return the lowest point of a sum of normal curves after a moving mean of 25 bins."""

    def mean_of_bins(x: float) -> float:
        return sum(
            height * sigma * (norm.cdf((x + 12.5 - c) / sigma) - norm.cdf((x - 12.5 - c) / sigma))
            for c, sigma, height in bells
        )

    return float(minimize_scalar(mean_of_bins, bounds=(low, high), method="bounded").x)


@pytest.mark.parametrize("second", [20_000, 60_000])
def test_the_threshold_lies_in_the_valley_between_two_bells(second: float) -> None:
    bells = [(60.0, 12.0, 100_000.0), (180.0, 20.0, second)]
    threshold = found(sum(bell(*b) for b in bells))
    assert threshold.value == pytest.approx(valley(bells, 60, 180), abs=1)
    assert threshold.peaks == pytest.approx((60, 180), abs=1)
    assert threshold.between == threshold.peaks
    assert threshold.reading == "two peaks"


def test_the_window_is_a_tenth_of_the_histogram_s_length() -> None:
    spike = np.zeros(BINS)
    spike[100] = 25_000
    (filled,) = np.nonzero(smooth(spike))
    assert (filled[0], filled[-1]) == (100 - 12, 100 + 12)  # 25 bins: the odd number below 25.6
    assert smooth(spike).max() == 1000
    # At the ends only the existing bins count.
    assert (smooth(np.full(BINS, 7.0)) == 7).all()
    # Two spikes nearer than the window are one peak.
    near, far = (bell(100, 2, 10_000) + bell(100 + gap, 2, 10_000) for gap in (16, 60))
    assert len(found(near).peaks) == 1
    assert found(far).value == pytest.approx(130, abs=1)


def test_the_threshold_lies_before_the_second_highest_of_three_peaks() -> None:
    """Air is highest, then white matter. The grey peak before that is lower than both."""
    bells = [(20.0, 8.0, 90_000.0), (120.0, 14.0, 20_000.0), (200.0, 14.0, 40_000.0)]
    threshold = found(sum(bell(*b) for b in bells))
    assert threshold.between == pytest.approx((120, 200), abs=2)
    assert threshold.value == pytest.approx(valley(bells, 120, 200), abs=1)
    # If grey is higher than white, grey is the second-highest, and air lies before it.
    bells = [(20.0, 8.0, 90_000.0), (120.0, 14.0, 40_000.0), (200.0, 14.0, 20_000.0)]
    threshold = found(sum(bell(*b) for b in bells))
    assert threshold.between == pytest.approx((20, 120), abs=2)


def test_the_darker_of_two_equal_peaks_counts_as_the_higher() -> None:
    one = bell(40, 8, 30_000)
    three = one + np.roll(one, 80) + np.roll(one, 160)
    threshold = found(three)
    # The darkest is the highest, the middle one the second, and the darkest lies before it.
    assert threshold.between == pytest.approx((40, 120), abs=1)
    # Counts are equal all over the valley, so the threshold lies in its middle.
    assert threshold.value == pytest.approx(80, abs=1)


def test_without_a_peak_before_the_second_highest_the_threshold_lies_after_it() -> None:
    threshold = found(bell(70, 12, 30_000) + bell(190, 12, 90_000))
    assert threshold.reading == "no peak before"
    assert threshold.value == pytest.approx(130, abs=8)
    assert threshold.between == pytest.approx((70, 190), abs=1)


def test_a_plateau_is_one_peak_at_its_middle() -> None:
    counts = np.zeros(BINS)
    counts[20:80] = 10_000
    counts[150:200] = 6_000
    threshold = found(counts)
    assert threshold.peaks == pytest.approx((50, 175), abs=0.5)
    # Smoothed counts are 0 between 92 and 138, so the threshold lies in the middle.
    assert threshold.value == pytest.approx(115, abs=0.5)


def test_a_single_peak_is_cut_at_the_foot_of_its_longer_side() -> None:
    scale = 30.0
    threshold = found(1e6 * np.exp(-AT / scale))
    assert threshold.reading == "single peak"
    assert len(threshold.between) == 1
    # The foot is farthest below the chord from peak to end, where the slopes are equal. A moving
    # mean of 25 bins keeps the shape of an exponential; at its end only 13 bins on one side exist.
    half, top = 12.5 / scale, (1 - np.exp(-13 / scale)) / (13 / scale)
    slope = np.sinh(half) / half / scale
    foot = scale * np.log(slope / (top / BINS))
    assert threshold.value == pytest.approx(foot, abs=1.5)


@pytest.mark.parametrize("counts", [np.zeros(BINS), np.full(BINS, 900), np.array([5])])
def test_a_flat_histogram_has_no_threshold(counts: NDArray[np.float64]) -> None:
    assert find_adaptive_threshold(histogram(counts)) is None


def test_a_peak_counts_however_low_it_is_beside_others() -> None:
    """A head at 7 T is an example. Grey matter rises 4 % above the saddle before it.

    That is many times the noise of counting. White matter stands apart and is lower.
    """
    bells = [(0.0, 20.0, 5e6), (115.0, 25.0, 40_000.0), (200.0, 12.0, 50_000.0)]
    fat = 150_000 * np.exp(-AT / 80)
    threshold = found(sum(bell(*b) for b in bells) + fat)
    _, grey, white = threshold.peaks
    heights, levels = threshold.smoothed, AT
    between = (levels > 60) & (levels < grey)
    saddle = heights[between].min()
    assert 0.02 < (heights[int(grey)] - saddle) / heights[int(grey)] < 0.05
    assert heights[int(white)] < heights[int(grey)]
    assert threshold.between == (threshold.peaks[0], grey)
    assert threshold.value == levels[between][heights[between].argmin()]


@pytest.mark.parametrize(("rise", "count"), [(4.0, 1), (6.0, 2)])
def test_a_rise_counts_from_five_standard_deviations_of_counting(rise: float, count: int) -> None:
    """Steps are as broad as the window, whose means equal them: 25 bins with 1000 voxels each."""
    deviation = np.sqrt(2 * 1000 / 25)
    top = 1000 + rise * deviation
    counts = np.concatenate(
        [np.full(60, 9000.0), np.full(60, 1000), np.full(60, top), np.zeros(76)]
    )
    threshold = found(counts)
    assert len(threshold.peaks) == count
    assert len(threshold.chance) == 2 - count
    (low,) = (*threshold.peaks[1:], *threshold.chance)
    assert low == pytest.approx(150, abs=2)


def test_single_voxels_of_a_long_tail_are_no_peaks() -> None:
    """An exponential is counted in 1000 bins: few voxels beyond bin 300, then single ones."""
    rng = np.random.default_rng(3)
    at = np.arange(1000)
    for _ in range(20):
        threshold = found(rng.poisson(1e6 * np.exp(-at / 25)).astype(float))
        assert len(threshold.peaks) == 1
        assert threshold.reading == "single peak"


def test_a_peak_must_exceed_the_chance_of_a_single_voxel() -> None:
    """In a window of 101 bins, 5 deviations of a height of 1 are 5 sqrt(2 / 101) = .70 per bin."""
    at = np.arange(1000)
    counts = np.where(at < 300, 1e6 * np.exp(-((at - 100) ** 2) / 800), 0)
    counts[800] = 60
    assert len(found(counts).peaks) == 1
    counts[800] = 90
    assert len(found(counts).peaks) == 2


def test_counting_noise_makes_no_peaks() -> None:
    """The bright tail is flat, with 100 voxels per bin plus Poisson noise."""
    rng = np.random.default_rng(0)
    bells = [(30.0, 9.0, 50_000.0), (150.0, 20.0, 9_000.0)]
    clean = np.asarray(sum(bell(*b) for b in bells)) + 100
    values = [found(rng.poisson(clean)).value for _ in range(20)]
    assert values == pytest.approx([valley(bells, 30, 150)] * 20, abs=5)
    assert all(len(found(rng.poisson(clean)).peaks) == 2 for _ in range(20))


def test_the_threshold_follows_gain_and_offset() -> None:
    counts = bell(60, 12, 100_000) + bell(180, 20, 30_000)
    plain = find_adaptive_threshold(histogram(counts))
    moved = find_adaptive_threshold(histogram(counts, -1000, -1000 + 4 * BINS))
    assert plain is not None
    assert moved is not None
    assert moved.value == pytest.approx(4 * plain.value - 1000)


def test_bins_of_integers_hold_equal_numbers_of_integers() -> None:
    every = np.arange(0, 1000, dtype=np.int16)  # 1000 numbers, 4 in each bin
    made = make_histogram(every, (0, 999))
    assert made.counts == (4,) * 250
    assert made.bin_width == 4
    assert (made.low, made.high) == (-0.5, 999.5)
    # Each of 70 numbers has its bin, and values outside of the window are left out.
    made = make_histogram(every, (10.2, 80.0))
    assert made.counts == (1,) * 70
    assert made.levels[[0, -1]].tolist() == [11, 80]
    # Real numbers have 256 equal bins.
    made = make_histogram(np.linspace(0, 1, 2561, dtype=np.float32)[:-1] + 1e-4, (0.0, 1.0))
    assert len(made.counts) == 256
    assert set(made.counts) <= {9, 10, 11}


# From the survey to the bundle


def two_bodies() -> NDArray[np.uint16]:
    """Return air of 100, a ball of 1000 and noise of 30, whose valley is wide."""
    rng = np.random.default_rng(1)
    z, y, x = np.ogrid[:24, :32, :40]
    ball = (z - 11.5) ** 2 + (y - 15.5) ** 2 + (x - 19.5) ** 2 < 9.5**2
    voxels = np.where(ball, 1000, 100) + rng.normal(0, 30, (24, 32, 40))
    return np.rint(np.maximum(voxels, 0)).astype(np.uint16)


def test_a_channel_has_a_threshold_and_a_ramp_at_it() -> None:
    statistics = find_statistics(two_bodies(), WindowOptions(0, 100))
    appearance = make_appearance(
        "MR",
        (1, 1, 1),
        statistics=statistics,
        level=SurfaceLevel(500.0, None, 1.0),
        confidence=0.9,
        why_unclear="",
    )
    assert appearance.threshold is not None
    assert 250 < appearance.threshold < 850
    assert appearance.threshold_normalized is not None
    table = evaluate(appearance.transfer_functions[THRESHOLD], size=1024)
    levels = np.linspace(0, 1, 1024)
    assert (table[levels <= appearance.threshold_normalized - 1e-3] == 0).all()
    assert table[np.searchsorted(levels, appearance.threshold_normalized) + 2] > 0
    assert (np.diff(table) >= 0).all()
    window = Window(statistics, Counting(Scale(0.0, 9.0, 4.0), None, 1.0))
    again = window_from_json(json.loads(json.dumps(window_to_json(window))))
    assert again == window
    flat = find_statistics(np.full(100, 7, np.uint8), WindowOptions())
    bare = make_appearance(
        "MR",
        (1, 1, 1),
        statistics=flat,
        level=SurfaceLevel(7.0, None, 1.0),
        confidence=1.0,
        why_unclear="",
    )
    assert bare.threshold is None
    assert THRESHOLD not in bare.transfer_functions


def test_the_report_draws_the_threshold_beside_those_of_otsu_and_li() -> None:
    voxels = two_bodies()
    statistics = find_statistics(voxels, WindowOptions(0, 100))
    otsu, li = find_peers(statistics.values)
    assert otsu == pytest.approx(
        filters.threshold_otsu(voxels), abs=2 * statistics.values.bin_width
    )
    assert li == pytest.approx(filters.threshold_li(voxels), abs=2 * statistics.values.bin_width)
    figure = draw_threshold(statistics)
    assert figure is not None
    assert [row.name for row in figure.rows] == ["adaptive", "Otsu", "Li"]
    for row in figure.rows:
        assert row.above == pytest.approx((voxels >= row.value).mean(), abs=0.002)
    for kind in ("mark", "otsu", "li", "curve", "area"):
        assert figure.chart.count(f'class="{kind}"') == 1
    assert figure.chart.count('class="peak"') == 2
    assert statistics.threshold is not None
    dark, bright = statistics.threshold.between
    assert dark == pytest.approx(100, abs=25)
    assert bright == pytest.approx(1000, abs=25)
    assert f"peak, at {bright:.5g}, and the peak before it, at {dark:.5g}" in figure.reading
    assert draw_threshold(find_statistics(np.full(100, 7, np.uint8), WindowOptions())) is None


def test_the_report_lists_peaks_that_may_be_chance() -> None:
    rng = np.random.default_rng(4)
    threshold = found(rng.poisson(bell(30, 9, 50_000) + bell(150, 20, 9_000) + 100).astype(float))
    assert threshold.chance
    assert "may be due to chance" in describe(threshold)
    assert f"{threshold.chance[0]:.5g}" in describe(threshold)
    smooth_one = found(bell(60, 12, 100_000) + bell(180, 20, 60_000))
    assert smooth_one.chance == ()
    assert "may be due to chance" not in describe(smooth_one)


def test_slices_are_black_below_the_threshold() -> None:
    volume = np.full((20, 30, 30), 100, np.uint8)
    volume[:, :, 15:] = 220
    picture = draw_cut(volume, (1.0, 1.0, 1.0), 0.7)
    grey = np.asarray(Image.open(io.BytesIO(picture.data)).convert("L"))
    middle = grey[grey.shape[0] // 3, : picture.width // 2]
    assert middle[:10].max() < 40
    assert middle.max() > 190


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a build whose surface lies at the threshold, up to its bundle."""
    folder = tmp_path_factory.mktemp("threshold")
    source = phantoms.write_ome_zarr(folder / "ball.ome.zarr", [two_bodies()])
    out = folder / "out"
    flags = ["--iso-criterion", "adaptive", "--grid", "2x1"]
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    for phase in ("units", "stage", "bundle"):
        assert main([phase, str(out), "--workers", "0"]) == 0
    return out


def manifest(bundle: Path) -> dict[str, object]:
    content = json.loads((bundle / "manifest.json").read_text("utf-8"))
    (channel,) = content["channels"]
    assert isinstance(channel, dict)
    return channel


@pytest.mark.slow
def test_the_adaptive_criterion_uses_the_threshold_in_every_tile(built: Path) -> None:
    (found,) = read_survey(OutFolder(built)).values()
    threshold = found.appearance.threshold
    assert threshold is not None
    assert {iso.value for iso in found.iso.values()} == {threshold}
    assert {iso.background for iso in found.iso.values()} == {0.0}
    assert len(found.iso) == 2
    assert found.appearance.iso_value == pytest.approx(threshold)
    assert 250 < threshold < 850


@pytest.mark.slow
def test_the_threshold_reaches_the_bundle_and_check_finds_nothing(built: Path) -> None:
    (found,) = read_survey(OutFolder(built)).values()
    low, high = found.appearance.window
    channel = manifest(built / "bundle")
    assert found.appearance.threshold is not None
    share = (found.appearance.threshold - low) / (high - low)
    assert channel["threshold_normalized"] == pytest.approx(share, abs=1e-6)
    assert THRESHOLD in channel["transfer_functions"]
    assert [line for line in check(built) if not line.ok] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("edit", "expected"), [("= 400", 400.0), ("= -9000", -1e9), ("= None", None)]
)
def test_an_edited_threshold_reaches_the_bundle(
    built: Path, tmp_path: Path, edit: str, expected: float | None
) -> None:
    layer = tmp_path / "edit.usda"
    ((name, found),) = read_survey(OutFolder(built)).items()
    low, high = found.appearance.window
    layer.write_text(
        f"""#usda 1.0
        (
            subLayers = [@{built}/stage/stage.usda@]
        )
        over "Specimen"
        {{
            over "Channels"
            {{
                over "{name}"
                {{
                    float stereocell:threshold {edit}
                }}
            }}
        }}
        """
    )
    assert main(["bundle", str(built), "--stage", str(layer), "--workers", "0"]) == 0
    normalized = manifest(built / "bundle")["threshold_normalized"]
    if expected is None:
        assert normalized is None
    else:
        assert normalized == pytest.approx(max(0, (expected - low) / (high - low)), abs=1e-6)


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, ">u2", np.int32, np.float32, np.float64])
@pytest.mark.parametrize("clips", [False, True])
def test_bins_hold_the_same_voxels_as_those_of_numpy(dtype: str | type, clips: bool) -> None:
    """Values on the edges are the ones that rounding could move into the next bin."""
    edges = np.linspace(0.1, 90.7, 152)
    near = np.concatenate([np.nextafter(edges, 0), edges, np.nextafter(edges, 100), [0, 99, 1e6]])
    voxels = (near if np.dtype(dtype).kind == "f" else np.arange(120)).astype(dtype)
    values = voxels.astype(np.float64)
    low, high = 5.0, 90.0
    kept = np.clip(values, low, high) if clips else values[(values >= low) & (values <= high)]
    expected, _ = np.histogram(kept, edges)
    found = count_in_bins(voxels[None, :], edges, (low, high), clips=clips)
    np.testing.assert_array_equal(found, expected)
