"""The share of the variance along the axes, on fields whose share is known."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.isosurface.axis_profiles import MAX_LIGHT, Profiles, share_of_light

SHAPE = (20, 30, 40)
Z, Y, X = np.ogrid[: SHAPE[0], : SHAPE[1], : SHAPE[2]]
CUTS = [((0, 20), (0, 30), (0, 40))]
TILES = [((0, 20), y, x) for y in ((0, 11), (11, 30)) for x in ((0, 25), (25, 40))]


def _all_of(field: NDArray[np.float32]) -> tuple[slice, slice, slice]:
    depth, height, width = field.shape
    return slice(0, depth), slice(0, height), slice(0, width)


def _share(field: NDArray[np.float64], cuts: list[tuple[tuple[int, int], ...]] = CUTS) -> float:
    field = np.broadcast_to(field, SHAPE)
    tiles = []
    for (z0, z1), (y0, y1), (x0, x1) in cuts:
        part = np.ascontiguousarray(field[z0:z1, y0:y1, x0:x1], np.float32)
        tiles.append(Profiles.of(part, np.zeros(part.shape, bool), _all_of(part), (z0, y0, x0)))
    return share_of_light(tiles, tiles, variance=float(field.var()))


@pytest.mark.parametrize(
    "field",
    [3.0 * X + np.sin(Y / 3), 10.0 ** (-Z / 19), 1.0 * (X > 12) + 2.0 * (Y > 20) + 0.1 * Z],
    ids=["ramp and stripes", "depth", "fields side by side"],
)
def test_sums_of_functions_of_one_axis_each_count_as_light(field: NDArray[np.float64]) -> None:
    assert _share(field) == pytest.approx(1.0, abs=1e-6)
    assert _share(field, TILES) == pytest.approx(1.0, abs=1e-6)


def test_a_product_counts_as_light_except_for_the_product_of_deviations() -> None:
    """The product (x - mean) (y - mean) has no part along an axis, (2 + x) (2 + y) a large one."""
    x, y = X - X.mean(), Y - Y.mean()
    assert _share(x * y) == pytest.approx(0.0, abs=1e-9)
    x, y = x / np.ptp(x), y / np.ptp(y)
    both = (x**2).mean() * (y**2).mean()
    alone = 4 * ((x**2).mean() + (y**2).mean())
    assert _share((2 + x) * (2 + y)) == pytest.approx(alone / (alone + both), rel=1e-6)


def test_a_ball_does_not_count_as_light_in_any_tiles() -> None:
    ball = 1.0 * ((Z - 10) ** 2 + (Y - 14) ** 2 + (X - 18) ** 2 < 64)
    assert _share(ball) < MAX_LIGHT / 2
    assert _share(ball, TILES) == pytest.approx(_share(ball), rel=1e-9)


def test_a_slab_that_fills_the_field_is_a_body() -> None:
    assert _share(1.0 * (np.abs(Z - 10) < 4)) == 0.0
    assert _share(1.0 * (Z > 10)) == pytest.approx(1.0)


def test_padding_is_left_out_of_the_profiles() -> None:
    field = np.broadcast_to(5.0 + X, SHAPE).astype(np.float32)
    kept = np.broadcast_to((Y > 3) & (Z < 15), SHAPE)
    hidden = np.where(kept, field, np.float32(1e6))
    tile = Profiles.of(hidden, ~kept, _all_of(field), (0, 0, 0))
    variance = float(field[kept].var())
    assert share_of_light([tile], [tile], variance=variance) == pytest.approx(1.0, rel=1e-5)
    nothing = Profiles.of(field, np.ones(SHAPE, bool), _all_of(field), (0, 0, 0))
    assert share_of_light([nothing], [nothing], variance=1.0) == 0.0
