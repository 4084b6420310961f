"""Options of the baked maps, and their size."""

from typing import Any

import numpy as np
import pytest
import pyvista as pv

from stereocell.errors import UsageError
from stereocell.mesh import Mesh
from stereocell.unwrap import UnwrapOptions, unwrap


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"coarse_lods": -1}, "unwrap.coarse_lods is -1, expected 0 or more"),
        ({"max_texture": 32}, "max_texture is 32, expected a power of two from 64 to 8192"),
        ({"max_texture": 1000}, "max_texture is 1000, expected a power of two from 64 to 8192"),
        ({"max_texture": 16384}, "max_texture is 16384, expected a power of two from 64"),
    ],
)
def test_options_out_of_range_are_wrong_usage(values: dict[str, Any], message: str) -> None:
    with pytest.raises(UsageError) as raised:
        UnwrapOptions(**values)
    assert message in str(raised.value)


@pytest.mark.parametrize(("texel_um", "size"), [(10.0, 64), (0.1, 256), (0.001, 512)])
def test_map_is_as_large_as_the_area_asks_within_its_limits(texel_um: float, size: int) -> None:
    sphere = pv.Sphere(radius=5.0, theta_resolution=24, phi_resolution=24)
    positions = np.asarray(sphere.points, np.float32)
    mesh = Mesh(positions, sphere.regular_faces.astype(np.uint32), positions / np.float32(5))
    assert unwrap(mesh, 512, texel_um)[1] == size  # sqrt(1.5 * 314 um2) is 21.7 um
