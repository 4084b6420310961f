"""Windows, histograms and transfer functions."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.model.channel import OpacityPoints, SurfaceLevel
from stereocell.model.lattice_field import LatticeField
from stereocell.steps import find_window as window_task
from stereocell.transfer.channel_statistics import find_statistics, make_appearance
from stereocell.transfer.opacity import (
    AT_SURFACE_OF_MAGNITUDES,
    MAX_SHIFT,
    NEAR_SURFACE,
    evaluate,
    make_transfer_functions,
)
from stereocell.transfer.options import WindowOptions
from support import phantoms

NAMES = ("default", "soft", "sharp", "surface")  # functions of a channel without a threshold


def test_window_lies_at_the_percentiles() -> None:
    voxels = np.arange(10001, dtype=np.uint16)
    statistics = find_statistics(voxels, WindowOptions(10, 90))
    assert statistics.window == (1000, 9000)
    assert sum(statistics.histogram) == voxels.size


def test_constant_channel_has_a_window_and_no_division_by_zero() -> None:
    assert find_statistics(np.full(100, 7, np.uint8), WindowOptions()).window == (7, 8)


def test_sparse_channel_keeps_its_few_bright_voxels() -> None:
    voxels = np.zeros(100_000, np.uint16)
    voxels[:5] = 900
    assert find_statistics(voxels, WindowOptions(1, 99)).window == (0, 900)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("limit", "levels", "seen"),
    [
        (16_000_000, 2, (0, np.s_[2:14, 4:32, 8:32])),
        (5000, 2, (1, np.s_[1:7, 2:16, 4:16])),  # too many voxels: those of the coarser level
        (5000, 1, (0, np.s_[2:14:2, 4:32, 8:32])),  # without a coarser level, some of the planes
    ],
)
def test_the_window_is_that_of_the_built_region(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    limit: int,
    levels: int,
    seen: tuple[int, tuple[slice, slice, slice]],
) -> None:
    """The data are dim on the left and bright on the right, and a part of the left is built."""
    monkeypatch.setattr(window_task, "SURVEY_VOXELS", limit)
    fine = np.random.default_rng(0).integers(100, 200, (16, 40, 80)).astype(np.uint16)
    fine[:, :, 36:] *= 10
    coarse = fine.reshape(8, 2, 20, 2, 40, 2).mean(axis=(1, 3, 5)).astype(np.uint16)
    pyramid = [fine, coarse][:levels]
    scales = [dict.fromkeys("zyx", 1.0), dict.fromkeys("zyx", 2.0)]
    source = phantoms.write_ome_zarr(tmp_path / "halves.ome.zarr", pyramid, scales=scales)
    out = tmp_path / "out"
    flags = ["--level", "0", "--region", "2:14,4:32,8:32"]
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    (channel,) = OutFolder(out).survey().values()
    level, part = seen
    options = WindowOptions()
    expected = np.percentile(
        pyramid[level][part], (options.low_percentile, options.high_percentile)
    )
    assert channel["statistics"]["window"] == pytest.approx(expected)
    assert sum(channel["statistics"]["histogram"]) == pyramid[level][part].size
    # The threshold is found on every voxel, even if few voxels give the window.
    low, high = channel["statistics"]["window"]
    whole = fine[2:14, 4:32, 8:32]
    inside = (whole >= low) & (whole <= high)
    assert sum(channel["statistics"]["values"]["counts"]) == np.count_nonzero(inside)


@pytest.mark.slow
def test_the_threshold_follows_from_the_survey_if_there_are_too_many_voxels(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(window_task, "SURVEY_VOXELS", 4000)
    monkeypatch.setattr(window_task, "COUNTED_VOXELS", 7999)
    voxels = np.random.default_rng(0).integers(100, 200, (20, 20, 20)).astype(np.uint16)
    source = phantoms.write_ome_zarr(tmp_path / "one.ome.zarr", [voxels])
    out = tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out)]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    (channel,) = OutFolder(out).survey().values()
    low, high = channel["statistics"]["window"]
    seen = voxels[::2]
    inside = (seen >= low) & (seen <= high)
    assert sum(channel["statistics"]["values"]["counts"]) == np.count_nonzero(inside)


@pytest.mark.parametrize("iso", [None, 0.0, 0.02, 0.3, 0.97, 1.0, 1.7])
@pytest.mark.parametrize("histogram", [np.eye(1, 256, 0)[0], np.ones(256), np.eye(1, 256, 255)[0]])
def test_every_function_is_valid_for_any_histogram(
    iso: float | None, histogram: np.ndarray
) -> None:
    functions = make_transfer_functions((1000 * histogram).astype(np.int64), iso)
    assert {"default", "soft", "sharp", "surface"} <= functions.keys()
    for points in functions.values():
        x, opacity = np.array(points).T
        assert (np.diff(x) >= 0).all()
        assert x[0] == 0
        assert x[-1] == 1
        assert opacity.min() >= 0
        assert 0 < opacity.max() <= 1
        table = evaluate(points)
        assert table[0] == 0
        assert np.isfinite(table).all()


def test_the_sharp_function_becomes_opaque_at_the_iso_value() -> None:
    histogram = np.exp(-((np.arange(256) - 30) ** 2) / 50) * 1e5
    functions = make_transfer_functions(histogram.astype(np.int64), 0.5)
    sharp = evaluate(functions["sharp"])
    assert sharp[int(0.45 * 255)] == 0
    assert sharp[int(0.55 * 255)] > 0.7
    for name, points in functions.items():
        assert evaluate(points)[30] == 0, name


@pytest.mark.parametrize("iso", [0.1, 0.3, 0.6])
def test_opacity_begins_near_a_surface_and_half_way_to_the_level_without_one(iso: float) -> None:
    background = np.exp(-((np.arange(256) - 8) ** 2) / 20) * 1e5
    histogram = (background + 50).astype(np.int64)
    opacity = evaluate(make_transfer_functions(histogram, iso)["default"])
    assert opacity[int(0.75 * iso * 255)] == 0
    assert opacity[int(iso * 255) + 1] > 0.15
    near, faint = (
        make_transfer_functions(histogram, level)["default"][1][0] for level in (0.9, None)
    )
    assert faint < 0.7 * near


def test_the_appearance_has_the_level_plus_the_background_s_mean() -> None:
    statistics = find_statistics(np.arange(101, dtype=np.uint8), WindowOptions(0, 100))
    knots = ((0.0,), (0.0,), (0.0, 9.0))
    background = LatticeField(knots, np.array([[[5.0, 15.0]]]))
    appearance = make_appearance(
        "CD31",
        (0, 1, 0),
        statistics=statistics,
        level=SurfaceLevel(20.0, background, 1.0),
        confidence=0.75,
        why_unclear="",
    )
    assert appearance.surface == "clear"
    assert appearance.iso_value == 30
    assert appearance.iso_confidence == 0.75
    assert appearance.iso_normalized == pytest.approx(0.3)
    assert appearance.level is not None
    assert appearance.level.words == "20 above a background of 5 to 15"


def test_without_a_surface_there_is_no_level_and_no_threshold() -> None:
    rng = np.random.default_rng(0)
    peaks = np.concatenate([rng.normal(60, 8, 20_000), rng.normal(180, 8, 9000)])
    statistics = find_statistics(peaks.round().astype(np.uint8), WindowOptions(0, 100))
    assert statistics.threshold is not None
    unsure, none = (
        make_appearance(
            "CD31",
            (0, 1, 0),
            statistics=statistics,
            level=level,
            confidence=0.3,
            why_unclear=reason,
        )
        for level, reason in ((SurfaceLevel(120.0, None, 1.0), ""), (None, "no clear surface"))
    )
    assert none.surface == "none"
    assert none.surface_reason == "no clear surface"
    assert unsure.surface == "unsure"
    assert unsure.surface_reason.startswith("unsure surface: at 120 with a confidence of 0.30;")
    assert none.threshold is None
    assert unsure.threshold is not None
    assert set(unsure.transfer_functions) - set(none.transfer_functions) == {"threshold"}
    assert none.transfer_functions["sharp"] != unsure.transfer_functions["sharp"]


def _veil(functions: dict[str, OpacityPoints], noise: NDArray[np.float64], voxels: int) -> float:
    """Return the opacity along a number of voxels of noise, by the function `default`."""
    absorbed = -np.log1p(-evaluate(functions["default"]))
    return 1 - float(np.exp(-voxels * (absorbed * noise / noise.sum()).sum()))


def test_noise_of_the_air_does_not_veil_a_surface_just_above_it() -> None:
    x = np.arange(256.0)
    sigma = 10.0
    air = x * np.exp(-(x**2) / (2 * sigma**2))  # Rayleigh noise, as in magnitudes of MR
    tissue = 0.3 * air.sum() * np.exp(-0.5 * ((x - 100) / 15) ** 2) / 37.6
    iso = 4.0 * sigma / 255
    histogram = (1e6 * (air + tissue) / air.sum()).astype(np.int64)
    functions = make_transfer_functions(histogram, iso, has_magnitudes=True)
    assert _veil(functions, air, 100) < 0.02
    assert evaluate(functions["default"])[int(iso * 255) + 1] > 0.1  # the surface itself is visible


def test_noise_that_continues_above_the_surface_does_not_show_as_dust() -> None:
    x = np.arange(256.0)
    # Magnitudes of a coil with uneven sensitivity have a longer tail than those at any one place.
    air = sum((x / s**2 * np.exp(-(x**2) / (2 * s**2)) for s in (5.0, 7.0, 9.0, 12.0)), 0 * x)
    air /= air.sum()
    tissue = 0.4 * np.exp(-0.5 * ((x - 110) / 20) ** 2) / 50
    level = 34
    assert air[level + 1 :].sum() > 0.004
    functions = make_transfer_functions(
        (1e7 * (air + tissue)).astype(np.int64), level / 255, has_magnitudes=True
    )
    opacity = evaluate(functions["default"])
    assert air[opacity > 0].sum() < 0.3 * air[level + 1 :].sum()
    assert (opacity[int(MAX_SHIFT * level) + 4 :] > 0.12).all()  # brighter values show as before
    for points in functions.values():
        assert (np.diff([x for x, _ in points]) > 0).all()  # as readers of the stage expect


def test_the_even_counts_of_an_edge_do_not_count_as_noise() -> None:
    x = np.arange(256.0)
    air = np.exp(-0.5 * ((x - 10) / 4) ** 2)
    edge = np.full(256, 0.02)  # voxels that lie partly in the body
    functions = make_transfer_functions(
        (1e6 * (air + edge)).astype(np.int64), 34 / 255, has_magnitudes=True
    )
    assert functions["default"][2] == (round(34 / 255, 4), AT_SURFACE_OF_MAGNITUDES)


def test_values_between_noise_and_a_far_surface_are_visible() -> None:
    x = np.arange(256.0)
    air = np.exp(-0.5 * ((x - 10) / 4) ** 2)
    start, opacity = make_transfer_functions(
        (1e6 * air).astype(np.int64), 0.5, has_magnitudes=True
    )["default"][1]
    assert start == pytest.approx(10 / 255 + NEAR_SURFACE * (0.5 - 10 / 255), abs=0.005)
    assert opacity == 0


def test_a_peak_of_tissue_does_not_count_as_background() -> None:
    x = np.arange(256.0)
    # The tissue fills the image, and lower values are its flank
    tissue = np.exp(-0.5 * ((x - 150) / 30) ** 2)
    full = make_transfer_functions((1e6 * tissue).astype(np.int64), 0.3, has_magnitudes=True)[
        "default"
    ]
    assert full[1][0] == pytest.approx(0.9 * 0.3)
    empty = make_transfer_functions(np.zeros(256, np.int64), 0.3, has_magnitudes=True)["default"]
    assert len(empty) == len(full)
