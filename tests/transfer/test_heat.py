"""The heat map of a tracer, from dark red to the channel's colour above the organs' level."""

import numpy as np

from stereocell.model.channel import SurfaceLevel
from stereocell.transfer.channel_statistics import find_statistics, make_appearance
from stereocell.transfer.heat import heat_shapes
from stereocell.transfer.options import WindowOptions
from stereocell.transfer.shapes2d import evaluate2d, find_fault


def test_more_of_a_tracer_is_lighter_and_denser_at_every_gradient() -> None:
    shapes = heat_shapes(0.2)
    assert not any(find_fault(shape) for shape in shapes)
    table = evaluate2d(shapes).astype(float) / 255
    assert (table[:, : int(0.2 * 255) - 1, 3] == 0).all()
    inside = table[:, int(0.28 * 255) :]
    assert (inside[..., 3] > 0.03).all()
    light = inside[0] @ (0.2126, 0.7152, 0.0722, 0.0)
    places = np.linspace(0, len(light) - 1, 8).astype(int)
    assert (np.diff(light[places]) > 0).all()
    np.testing.assert_allclose(inside[0], inside[-1])


def test_a_veil_shows_the_body_around_the_organs_and_hardly_changes_their_colours() -> None:
    bare, veiled = (evaluate2d(heat_shapes(0.2, body)).astype(int) for body in (None, 0.05))
    body = veiled[:, int(0.07 * 255) : int(0.19 * 255), 3]
    assert (body > 0).all()
    passed = (1 - body.max() / 255) ** 60  # share of the light that crosses a body of 60 voxels
    assert 0.5 < passed < 0.8
    assert (veiled[:, : int(0.05 * 255) - 1, 3] == 0).all()  # air
    organs = slice(int(0.28 * 255), None)
    assert np.abs(veiled[:, organs] - bare[:, organs]).max() <= 12
    # A threshold within the organs does not separate the body from the air.
    assert heat_shapes(0.2, 0.19) == heat_shapes(0.2) == heat_shapes(0.2, 0.3)


def test_a_pet_is_first_shown_by_its_heat_map_above_the_organs_level() -> None:
    rng = np.random.default_rng(0)
    voxels = np.concatenate([rng.gamma(1.2, 150, 90_000), rng.normal(4000, 500, 5_000)])
    statistics = find_statistics(voxels, WindowOptions())
    appearance = make_appearance(
        "PT", (1, 1, 1), statistics=statistics, level=SurfaceLevel(1500.0, None, 1.0),
        confidence=1.0, why_unclear="", modality="PT",
    )  # fmt: skip
    assert appearance.function == "heat"
    shapes = appearance.transfer_2d.functions["heat"]
    assert appearance.iso_normalized is not None
    assert abs(shapes[0].values[0] - appearance.iso_normalized) < 1e-6
    # Programs without gradients show the same values.
    points = dict(appearance.transfer_functions["heat"])
    assert max(points.values()) > 0.4
