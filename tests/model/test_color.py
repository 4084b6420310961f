"""Conversions between colour spaces."""

import numpy as np
import pytest

from stereocell.model.color import linear_color_of_lab, to_srgb8


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


def test_srgb_bytes_follow_the_standard_for_every_share() -> None:
    shares = np.linspace(-0.5, 1.5, 400_001).astype(np.float32)
    exact = np.clip(shares.astype(np.float64), 0, 1)
    curve = np.where(exact <= 0.0031308, 12.92 * exact, 1.055 * exact ** (1 / 2.4) - 0.055)
    assert (to_srgb8(shares) == np.round(255 * curve)).all()
    assert to_srgb8(np.float32([[-0.0, np.inf], [-np.inf, 1e-30]])).tolist() == [[0, 255], [0, 0]]
