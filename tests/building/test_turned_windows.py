"""The window, background and holder of a channel are the same for slices across z, y or x.

Each filter is asked for a volume and for the same volume turned, and has to give the same, turned.
"""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.filters.background import find_background
from stereocell.filters.min_max_bricks import mip_levels
from stereocell.isosurface.find_holder import find_holder
from stereocell.model.image_plane import back_of_three, slices_back
from stereocell.model.tiling import Box
from stereocell.planning.survey_steps import window_step
from stereocell.steps import find_window as window_module
from stereocell.steps.find_window import Window
from support import phantoms

SHAPE, SPACING = (20, 72, 60), (4.0, 1.0, 1.0)  # (slice, row, column)
AXES = pytest.mark.parametrize("axis", [1, 2])


def _cells() -> NDArray[np.uint16]:
    """Return balls in noise with padding at one side, on a background that rises along all axes."""
    rng = np.random.default_rng(5)
    field = np.zeros(SHAPE)
    for centre in rng.uniform((8, 8, 8), (72, 64, 52), (14, 3)):
        field += phantoms.blurred_ball(SHAPE, SPACING, tuple(centre), 6.0, 1.5)
    slices, rows, columns = np.indices(SHAPE)
    ground = 200 + 6 * slices + 3 * rows + 1.5 * columns
    counts = ground + 900 * field + rng.normal(0, 12, SHAPE)
    counts[:, :, :6] = 0
    return counts.round().clip(0, 65535).astype(np.uint16)


def _turned(voxels: NDArray[np.uint16], axis: int) -> NDArray[np.uint16]:
    return np.ascontiguousarray(slices_back(voxels, axis))


def _window(folder: Path, axis: int) -> Window:
    """Return the window of the cells, written with slices across an axis."""
    scale = dict(zip("zyx", back_of_three(SPACING, axis), strict=True))
    source = phantoms.write_ome_zarr(
        folder / f"{axis}.ome.zarr", [_turned(_cells(), axis)], scales=[scale]
    )
    out = folder / f"out{axis}"
    assert main(["plan", str(source), "-o", str(out)]) == 0
    plan = OutFolder(out).plan()
    assert plan.slice_axis == axis
    return window_step(plan, plan.channels[0]).run()


@pytest.mark.parametrize("most", [10**9, 40_000])
@AXES
def test_windows_and_backgrounds_turn_with_the_volume(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, axis: int, most: int
) -> None:
    """This also holds if some slices stand for all, and blocks for the whole volume."""
    monkeypatch.setattr(window_module, "SURVEY_VOXELS", most)
    monkeypatch.setattr(window_module, "JOINT_VOXELS", most)
    first, turned = _window(tmp_path, 0), _window(tmp_path, axis)
    statistics, others = first.statistics, turned.statistics
    assert statistics.background is not None
    assert others.background is not None
    assert turned.counting.scale == first.counting.scale
    assert turned.counting.darkest == first.counting.darkest == 0
    assert turned.max_shift == first.max_shift
    assert others.window == statistics.window
    assert others.histogram == statistics.histogram
    assert others.values == statistics.values
    shapes = [one.suggested.transfer_2d for one in (statistics, others)]
    assert shapes[0].functions
    assert shapes[1].functions == shapes[0].functions
    assert shapes[1].gradient_max == shapes[0].gradient_max
    np.testing.assert_allclose(
        others.background.values, slices_back(statistics.background.values, axis), atol=1e-6
    )


def _ct() -> NDArray[np.int16]:
    """Return a body with a bone on a table, in Hounsfield units, (slice, row, column)."""
    _, rows, columns = np.indices((24, 90, 80))
    hu = np.full(rows.shape, -1000, np.int16)
    body = ((rows - 40) / 26) ** 2 + ((columns - 40) / 32) ** 2 < 1
    hu[body] = 40
    hu[(rows - 38) ** 2 + (columns - 42) ** 2 < 36] = 900
    hu[(rows >= 76) & (rows < 80)] = 100
    return hu


@AXES
def test_a_holder_turns_with_the_volume(axis: int) -> None:
    spacing_um = (10_000.0, 4_000.0, 4_000.0)
    voxels = _ct()
    first = find_holder(voxels, spacing_um, Box((0, 0, 0), voxels.shape))
    turned = slices_back(voxels, axis)
    z, y, x = turned.shape
    other = find_holder(turned, back_of_three(spacing_um, axis), Box((0, 0, 0), (z, y, x)))
    assert first is not None
    assert other is not None
    assert first.mask[12, 78, 40]
    np.testing.assert_array_equal(other.mask, slices_back(first.mask, axis))


@AXES
def test_mip_levels_turn_with_the_volume(axis: int) -> None:
    voxels = (_cells() >> 4).astype(np.uint8)
    for level, turned in zip(mip_levels(voxels), mip_levels(_turned(voxels, axis)), strict=True):
        # float32 sums in another order may differ in their last bit
        difference = np.abs(turned.astype(int) - slices_back(level, axis))
        assert difference.max() <= 1
        assert np.mean(difference > 0) < 0.01


@AXES
def test_a_background_of_the_same_voxels_turns_with_them(axis: int) -> None:
    voxels = _cells()
    found = [
        find_background(
            turned,
            Box((0, 0, 0), turned.shape),
            spacing_um=back_of_three(SPACING, side),
            block_um=32.0,
            padding=turned == 0,
        ).values
        for side in (0, axis)
        for turned in [_turned(voxels, side)]
    ]
    np.testing.assert_allclose(found[1], slices_back(found[0], axis), atol=1e-6)


@pytest.mark.parametrize("zeros", [0.0, 0.5, 0.9])
def test_the_noise_of_objects_is_measured_despite_much_even_background(
    tmp_path: Path, zeros: float
) -> None:
    """A masked volume has noise only in the part that is left."""
    voxels = np.random.default_rng(1).normal(1000, 30, (12, 100, 100)).round().astype(np.uint16)
    voxels[:, :, : round(100 * zeros)] = 0
    voxels[:, 40:60, 94:] += 800
    source = phantoms.write_ome_zarr(
        tmp_path / "one.ome.zarr", [voxels], scales=[dict(zip("zyx", (1.0,) * 3, strict=True))]
    )
    assert main(["plan", str(source), "-o", str(tmp_path / "out")]) == 0
    plan = OutFolder(tmp_path / "out").plan()
    shift = window_step(plan, plan.channels[0]).run().max_shift
    assert shift == pytest.approx(2 * 30, rel=0.3)
