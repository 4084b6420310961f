"""Windows, histograms and transfer functions."""

import numpy as np
import pytest

from stereocell.config import WindowOptions
from stereocell.specimen import evaluate
from stereocell.survey import find_display, make_look
from stereocell.transfer import NAMES, make_transfer_functions


def test_window_lies_at_the_percentiles() -> None:
    voxels = np.arange(10001, dtype=np.uint16)
    display = find_display(voxels, WindowOptions(10, 90))
    assert display.window == (1000, 9000)
    assert sum(display.histogram) == voxels.size


def test_constant_channel_has_a_window_and_no_division_by_zero() -> None:
    assert find_display(np.full(100, 7, np.uint8), WindowOptions()).window == (7, 8)


def test_sparse_channel_keeps_its_few_bright_voxels() -> None:
    voxels = np.zeros(100_000, np.uint16)
    voxels[:5] = 900
    assert find_display(voxels, WindowOptions(1, 99)).window == (0, 900)


@pytest.mark.parametrize("iso", [None, 0.0, 0.02, 0.3, 0.97, 1.0, 1.7])
@pytest.mark.parametrize("histogram", [np.eye(1, 256, 0)[0], np.ones(256), np.eye(1, 256, 255)[0]])
def test_every_function_is_legal_for_any_histogram(
    iso: float | None, histogram: np.ndarray
) -> None:
    functions = make_transfer_functions((1000 * histogram).astype(np.int64), iso)
    assert tuple(functions) == NAMES
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


def test_sharp_turns_opaque_at_the_iso_value_and_background_is_clear() -> None:
    histogram = np.exp(-((np.arange(256) - 30) ** 2) / 50) * 1e5
    functions = make_transfer_functions(histogram.astype(np.int64), 0.5)
    sharp = evaluate(functions["sharp"])
    assert sharp[int(0.45 * 255)] == 0
    assert sharp[int(0.55 * 255)] > 0.7
    for name in NAMES:
        assert evaluate(functions[name])[30] == 0, name


def test_look_means_over_the_tiles_that_have_a_surface() -> None:
    display = find_display(np.arange(101, dtype=np.uint8), WindowOptions(0, 100))
    look = make_look(
        "CD31", (0, 1, 0), display, {"a": 20.0, "b": 40.0, "c": None}, {"a": 1, "b": 0.5, "c": 0}
    )
    assert look.iso_value == 30
    assert look.iso_confidence == 0.75
    assert look.iso_normalized == pytest.approx(0.3)
