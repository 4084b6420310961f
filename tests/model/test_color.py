"""Conversions between colour spaces."""

import pytest

from stereocell.model.color import linear_color_of_lab


@pytest.mark.parametrize(
    ("lab", "rgb"),
    [
        ((0, 0, 0), (0, 0, 0)),
        ((100, 0, 0), (1, 1, 1)),
        ((50, 0, 0), (0.1842, 0.1842, 0.1842)),  # ((50 + 16) / 116)^3
        ((54.29, 80.81, 69.89), (1, 0, 0)),  # sRGB's primaries under D50
        ((87.82, -79.27, 80.99), (0, 1, 0)),
        ((29.57, 68.30, -112.03), (0, 0, 1)),
        ((100, -128, 127), (0, 1, 0)),  # outside of sRGB, so clipped
    ],
)
def test_a_lab_colour_has_the_expected_linear_rgb(
    lab: tuple[float, float, float], rgb: tuple[float, float, float]
) -> None:
    assert linear_color_of_lab(lab) == pytest.approx(rgb, abs=3e-3)
