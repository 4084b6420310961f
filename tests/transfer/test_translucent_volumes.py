"""Volumes of microscopes are translucent at first: light crosses them, and shows inner bodies."""

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.model.channel import Appearance, SurfaceLevel
from stereocell.model.modality import SEGMENTATION
from stereocell.transfer.channel_statistics import find_statistics, make_appearance
from stereocell.transfer.opacity import evaluate, make_transfer_functions
from stereocell.transfer.options import WindowOptions

LEVEL = 450.0


def _stain(filled: float) -> NDArray[np.float64]:
    """Return voxels of cells that fill a share of a dark volume."""
    rng = np.random.default_rng(0)
    inside = round(100_000 * filled)
    return np.concatenate([rng.poisson(100, 100_000 - inside), rng.normal(900, 120, inside)])


def _opened(modality: str, *, has_surface: bool = True) -> Appearance:
    return make_appearance(
        "Channel",
        (1, 1, 1),
        statistics=find_statistics(_stain(0.1), WindowOptions(0, 100)),
        level=SurfaceLevel(LEVEL, None, 1.0) if has_surface else None,
        confidence=1.0,
        why_unclear="" if has_surface else "no clear surface",
        modality=modality,
    )


def _passed(filled: float, depth_voxels: float) -> float:
    """Return the mean light, 0..1, that crosses the whole volume with the soft function."""
    statistics = find_statistics(_stain(filled), WindowOptions(0, 100))
    low, high = statistics.window
    histogram = np.asarray(statistics.histogram)
    functions = make_transfer_functions(
        histogram, (LEVEL - low) / (high - low), depth_voxels=depth_voxels
    )
    absorbed = -np.log1p(-evaluate(functions["soft"]))
    return float(np.exp(-depth_voxels * (absorbed @ histogram) / histogram.sum()))


@pytest.mark.parametrize(
    ("modality", "function"),
    [("", "soft"), ("US", "default"), ("PT", "heat"), (SEGMENTATION, "default")],
)
def test_only_volumes_of_microscopes_are_translucent_at_first(modality: str, function: str) -> None:
    assert _opened(modality).function == function


def test_a_volume_without_a_surface_is_shown_as_a_body_at_first() -> None:
    assert _opened("", has_surface=False).function == "default"


@pytest.mark.parametrize("depth_voxels", [40.0, 200.0])
@pytest.mark.parametrize("filled", [0.05, 0.15])
def test_light_crosses_volumes_of_any_depth_and_density(depth_voxels: float, filled: float) -> None:
    assert _passed(filled, depth_voxels) > 0.35


def test_a_thin_volume_keeps_the_soft_opacity() -> None:
    histogram = np.bincount([10] * 900 + [200] * 100, minlength=256).astype(np.int64)
    thin, unknown = (
        make_transfer_functions(histogram, 0.4, depth_voxels=depth)["soft"] for depth in (5.0, 0.0)
    )
    assert thin == unknown
    assert evaluate(thin)[-1] == pytest.approx(0.2)


def test_the_deepest_volume_has_opacities_of_many_steps_of_8_bits() -> None:
    histogram = np.bincount([200] * 1000, minlength=256).astype(np.int64)
    deep = make_transfer_functions(histogram, 0.4, depth_voxels=10_000.0)["soft"]
    assert 255 * evaluate(deep)[-1] > 10


def test_the_soft_function_begins_where_the_default_one_does() -> None:
    histogram = np.bincount([10] * 900 + [200] * 100, minlength=256).astype(np.int64)
    functions = make_transfer_functions(histogram, 0.4)
    assert functions["soft"][1] == functions["default"][1]
