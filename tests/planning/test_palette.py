"""The palette's colours differ for people with normal and with colour-blind vision."""

from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray
from skimage.color import deltaE_ciede2000, rgb2hsv, rgb2lab

from stereocell.model.color import linear_color, to_srgb8
from stereocell.planning.channels import PALETTE
from stereocell.samples.microscope import STAINS

# From linear RGB to the perceived colour: Machado et al., "A Physiologically-based Model for
# Simulation of Color Vision Deficiency", IEEE TVCG 15(6), 2009, table 1, severity 1
VISIONS = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "deuteranopia": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
}
# Light changes the lightness of a surface, so lightness counts for less than hue.
LIGHTNESS_COUNTS = 1.6


def least_difference(colors: NDArray[np.float64], vision: NDArray[np.float64]) -> float:
    seen = np.clip(colors @ vision.T, 0, 1).astype(np.float32)
    lab = rgb2lab(to_srgb8(seen))
    return min(
        float(deltaE_ciede2000(lab[a], lab[b], kL=LIGHTNESS_COUNTS))
        for a, b in combinations(range(len(lab)), 2)
    )


@pytest.mark.parametrize("vision", VISIONS)
def test_any_two_colours_of_the_palette_differ(vision: str) -> None:
    colors = np.array(PALETTE)
    assert least_difference(colors, VISIONS[vision]) > 10
    assert least_difference(colors[:3], VISIONS[vision]) > 23


@pytest.mark.parametrize("vision", VISIONS)
def test_colours_of_the_sample_s_stains_differ(vision: str) -> None:
    rgb = [bytes.fromhex(stain.color) for stain in STAINS]
    colors = np.array([linear_color((code[0], code[1], code[2])) for code in rgb])
    assert least_difference(colors, VISIONS[vision]) > 23


def test_no_colour_is_a_pure_primary_or_too_dark_for_a_dark_ground() -> None:
    rgb = to_srgb8(np.array(PALETTE, np.float32))
    assert rgb2hsv(rgb)[:, 1].max() < 0.8
    assert rgb2lab(rgb)[:, 0].min() > 40
