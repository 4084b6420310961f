"""Boundaries in the histogram of bodies whose materials and blur are known."""

from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import erf

from stereocell.samples.head import make_head
from stereocell.transfer.boundaries import Boundaries, find_boundaries, suggest, suggest_shapes
from stereocell.transfer.edge_model import HistogramGrid, count_edge, find_steepest
from stereocell.transfer.joint_histogram import (
    COLUMNS,
    FINE_ROWS,
    ROWS,
    STEEPEST,
    choose_gradient_max,
    count_joint,
    rebin,
    to_eight_bits,
)
from stereocell.transfer.shapes2d import evaluate2d, find_fault
from support.exhaustive import sweep
from support.phantoms import blurred_ball

Spacing = tuple[float, float, float]
EVEN: Spacing = (1.0, 1.0, 1.0)


def nested(
    values: tuple[float, ...],
    radii_um: tuple[float, ...],
    sigma_um: float,
    noise: float,
    spacing: Spacing = EVEN,
) -> NDArray[np.uint8]:
    """Return nested balls in a box of 72 um; values[0] is the value around them."""
    shape = tuple(round(72 / h) for h in spacing)
    center = tuple((n - 1) * h / 2 for n, h in zip(shape, spacing, strict=True))
    field = np.full(shape, values[0])
    for before, after, radius in zip(values, values[1:], radii_um, strict=False):
        field += (after - before) * blurred_ball(shape, spacing, center, radius, sigma_um)
    field += np.random.default_rng(0).normal(0, noise, shape)
    return to_eight_bits(field, (0, 1))


def fine_counts(voxels: NDArray[np.uint8], spacing: Spacing = EVEN) -> NDArray[np.int64]:
    return count_joint(voxels, spacing, gradient_max=STEEPEST, rows=FINE_ROWS)


def boundaries_in(voxels: NDArray[np.uint8], spacing: Spacing = EVEN) -> tuple[Boundaries, float]:
    fine = fine_counts(voxels, spacing)
    gradient_max = choose_gradient_max(fine)
    return find_boundaries(
        rebin(fine, gradient_max), gradient_max, spacing_um=spacing
    ), gradient_max


@pytest.mark.parametrize(
    ("sigma", "noise", "spacing"),
    sweep(
        product([0.7, 1.0, 1.5], [0.01, 0.02, 0.03], [EVEN, (2.0, 1.0, 1.0)]),
        # Each blur, noise and spacing occurs, and the extremes together.
        kept=[
            (0.7, 0.01, EVEN),
            (0.7, 0.03, (2.0, 1.0, 1.0)),
            (1.0, 0.02, EVEN),
            (1.5, 0.01, (2.0, 1.0, 1.0)),
            (1.5, 0.03, EVEN),
        ],
    ),
)
def test_arcs_of_three_nested_materials_end_at_the_materials(
    sigma: float, noise: float, spacing: Spacing
) -> None:
    truth = (0.15, 0.5, 0.85)
    found, gradient_max = boundaries_in(nested(truth, (28, 18), sigma, noise, spacing), spacing)
    assert found.reason == ""
    assert found.materials == pytest.approx(truth, abs=noise)
    assert [(boundary.low, boundary.high) for boundary in found.boundaries] == [
        (pytest.approx(0.15, abs=noise), pytest.approx(0.5, abs=noise)),
        (pytest.approx(0.5, abs=noise), pytest.approx(0.85, abs=noise)),
    ]
    for boundary in found.boundaries:
        assert boundary.blur == pytest.approx(sigma, rel=0.35)
        # By theory, the step of an ideal edge over two voxels
        step = 0.35 * erf(1 / (sigma * np.sqrt(2)))
        assert boundary.apex * gradient_max == pytest.approx(step, rel=0.2)
        assert boundary.apex <= boundary.steepest <= boundary.apex * np.sqrt(3)
        assert 0 < boundary.share < 0.2


def test_materials_that_do_not_touch_have_no_boundary() -> None:
    """The bright shell has .1 outside and .45 inside, so no edge goes from .1 to .45."""
    found, _ = boundaries_in(nested((0.1, 0.8, 0.45), (30, 20), 1.2, 0.015))
    assert [(round(boundary.low, 1), round(boundary.high, 1)) for boundary in found.boundaries] == [
        (0.1, 0.8),
        (0.5, 0.8),
    ]


def test_a_source_with_few_values_has_the_same_materials() -> None:
    coarse = np.rint(nested((0.15, 0.5, 0.85), (28, 18), 1.2, 0.02) / 6.0) * 6
    found, _ = boundaries_in(coarse.astype(np.uint8))
    assert found.materials == pytest.approx((0.15, 0.5, 0.85), abs=0.02)
    assert len(found.boundaries) == 2


@pytest.mark.parametrize(
    ("voxels", "reason"),
    [
        (np.zeros((0, 4, 4), np.uint8), "no voxels were counted"),
        (np.full((20, 20, 20), 7, np.uint8), "materials found: 1, expected at least 2"),
        (np.zeros((1, 20, 2), np.uint8), "materials found: 1, expected at least 2"),
        (np.full((9, 9, 9), 255, np.uint8), "materials found: 1, expected at least 2"),
        (nested((0.4,), (), 1, 0.03), "materials found: 1, expected at least 2"),
        (
            np.random.default_rng(0).integers(0, 256, (40, 40, 40)).astype(np.uint8),
            "materials found: 1, expected at least 2",
        ),
    ],
    ids=["nothing", "constant", "a row", "saturated", "one material", "noise alone"],
)
def test_without_a_boundary_there_is_no_suggestion_but_a_reason(
    voxels: NDArray[np.uint8], reason: str
) -> None:
    suggested = suggest(fine_counts(voxels) if voxels.size else np.zeros((FINE_ROWS, COLUMNS), int))
    assert (suggested.shapes, suggested.reason) == ((), reason)
    assert suggested.transfer_2d.gradient_max > 0


@pytest.mark.slow
def test_the_suggested_shapes_show_boundaries_and_not_the_materials() -> None:
    voxels = nested((0.15, 0.5, 0.85), (28, 18), 1.2, 0.02)
    fine = fine_counts(voxels)
    suggested = suggest(fine)
    assert suggested == suggest(fine)
    assert [shape.kind for shape in suggested.shapes] == ["triangle", "triangle"]
    assert not any(find_fault(shape) for shape in suggested.shapes)
    outer, inner = suggested.shapes
    assert (outer.tip, inner.tip) == (
        pytest.approx(0.325, abs=0.02),
        pytest.approx(0.675, abs=0.02),
    )
    assert outer.opacity < inner.opacity

    opacity = evaluate2d(suggested.shapes)[..., 3] > 12
    apex = 0.35 * erf(1 / (1.2 * np.sqrt(2))) / suggested.transfer_2d.gradient_max
    for middle in (0.325, 0.675):
        assert opacity[round(0.95 * apex * (ROWS - 1)), round(255 * middle)]
    # Far inside of a material, all voxels except the noisiest stay clear.
    counts = rebin(fine, suggested.transfer_2d.gradient_max)
    for material in (0.15, 0.5, 0.85):
        near = np.abs(np.arange(COLUMNS) / 255 - material) < 0.03
        assert counts[opacity & near].sum() < 0.01 * counts[:, near].sum()


def test_a_triangle_ends_below_an_arc_that_passes_over_it() -> None:
    """The edge from .1 to .8 is steeper at .625 than the edge from .45 to .8."""
    found, _ = boundaries_in(nested((0.1, 0.8, 0.45), (30, 20), 1.2, 0.015))
    lower, upper = suggest_shapes(found)
    assert lower.tip < upper.tip
    assert lower.gradients[1] == 1
    inner = found.boundaries[1]
    assert inner.apex < upper.gradients[1] < 1.5 * inner.apex


@pytest.mark.slow
def test_the_noise_and_materials_of_the_head_are_found() -> None:
    """The phantom has background, CSF 300, grey matter 620 and white 1000, in noise of 50."""
    head = make_head()
    low, high = (float(v) for v in np.percentile(head.voxels, (0.5, 99.95)))
    fine = fine_counts(to_eight_bits(head.voxels, (low, high)), head.spacing_um)
    gradient_max = choose_gradient_max(fine)
    found = find_boundaries(rebin(fine, gradient_max), gradient_max)
    counts = [low + material * (high - low) for material in found.materials]
    assert counts[1:] == pytest.approx([300, 620, 1000], abs=50)
    assert 0 < counts[0] < 100  # only Rician noise
    assert found.boundaries
    assert not any(find_fault(shape) for shape in suggest_shapes(found))


AIR, FLUID, GREY_MATTER, SKIN, WHITE_MATTER = 0.0, 300.0, 620.0, 750.0, 1000.0


def head_boundaries(noise: float) -> tuple[Boundaries, tuple[float, float]]:
    """Return the boundaries of the phantom, and its window with the preset mri."""
    head = make_head(noise=noise)
    low, high = (float(v) for v in np.percentile(head.voxels, (1, 99.8)))
    found, _ = boundaries_in(to_eight_bits(head.voxels, (low, high)), head.spacing_um)
    return found, (low, high)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("noise", "expected"),
    [
        (0.02, [(AIR, SKIN), (FLUID, GREY_MATTER), (GREY_MATTER, WHITE_MATTER)]),
        # The phantom's skin has no peak of its own here. Its arc goes to the next material.
        (0.05, [(AIR, WHITE_MATTER), (FLUID, GREY_MATTER), (GREY_MATTER, WHITE_MATTER)]),
    ],
)
def test_tissues_of_the_head_that_touch_have_boundaries(
    noise: float, expected: list[tuple[float, float]]
) -> None:
    found, (low, high) = head_boundaries(noise)
    ends = [
        (low + boundary.low * (high - low), low + boundary.high * (high - low))
        for boundary in found.boundaries
    ]
    for dark, bright in expected:
        near = [e for e in ends if abs(e[0] - dark) < 70 and abs(e[1] - bright) < 40]
        assert len(near) == 1, (dark, bright, ends)
    # Fluid lies only at the cortex, and white matter inside of it, so neither touches skin.
    assert not [e for e in ends if abs(e[0] - FLUID) < 40 and abs(e[1] - SKIN) < 40]


@pytest.mark.slow
@pytest.mark.parametrize("noise", [0.02, 0.05])
def test_no_shape_reaches_the_values_of_the_materials_beside_it(noise: float) -> None:
    """Two of three voxels inside of a material lie within one sigma of Rician noise."""
    found, (low, high) = head_boundaries(noise)
    sigma = noise * 1000 / (high - low)
    boundaries = sorted(
        found.boundaries, key=lambda boundary: (boundary.low + boundary.high, boundary.low)
    )
    for boundary, shape in zip(boundaries, suggest_shapes(found), strict=True):
        room = 1.0 * sigma if boundary.low > 0.1 else 0.6 * sigma  # in air: sigma sqrt(2 - pi / 2)
        assert shape.values[0] >= boundary.low + room
        assert shape.values[1] <= boundary.high - room
        assert (evaluate2d((shape,))[:, round(255 * boundary.low), 3] == 0).all()
        assert (evaluate2d((shape,))[:, round(255 * boundary.high), 3] == 0).all()


def test_an_edge_sharper_than_a_voxel_is_steeper_if_it_is_oblique() -> None:
    """Along the diagonal each axis sees the whole step between two voxels, hence sqrt 3."""
    assert find_steepest(0.05, (1, 1, 1)) == pytest.approx(np.sqrt(3), rel=0.01)
    # An edge that is blurred over many voxels is equally steep in all directions.
    assert find_steepest(6.0, (1, 1, 1)) == pytest.approx(erf(1 / (6 * np.sqrt(2))), rel=0.01)


@pytest.mark.parametrize("spacing", [EVEN, (2.0, 1.0, 1.0)])
def test_the_modelled_edge_has_as_many_voxels_as_a_ball_s_surface(spacing: Spacing) -> None:
    """The count is independent: voxels of a ball, whose surface has all directions."""
    sigma, radius, noise = 0.8, 25.0, 0.03
    voxels = nested((0.2, 0.8), (radius,), sigma, noise, spacing)
    counted = (
        count_joint(voxels, spacing, gradient_max=1.0).reshape(ROWS, COLUMNS // 4, 4).sum(axis=2)
    )
    grid = HistogramGrid(ROWS, COLUMNS // 4, 1.0, spacing)
    area = 4 * np.pi * radius**2 / spacing[0]  # voxels in a layer one finest spacing thick
    expected = area * count_edge(0.2, 0.8, blur=sigma, sigma=noise, grid=grid)
    # Above the noise, by rows and by columns
    steep = slice(20, None)
    for axis in (0, 1):
        a, b = counted[steep].sum(axis), expected[steep].sum(axis)
        assert a.sum() == pytest.approx(b.sum(), rel=0.05)
        assert np.abs(np.cumsum(a) - np.cumsum(b)).max() < 0.04 * a.sum()


def test_a_shape_is_suggested_for_a_boundary_at_the_ends_of_the_window() -> None:
    found, _ = boundaries_in(nested((0.02, 0.98), (20,), 0.8, 0.01))
    (boundary,) = found.boundaries
    assert (boundary.low, boundary.high) == (
        pytest.approx(0.02, abs=0.01),
        pytest.approx(0.98, abs=0.01),
    )
    (shape,) = suggest_shapes(found)
    assert find_fault(shape) == ""
    assert shape.gradients[1] > 0.9
