"""Surfaces with baked maps stay closed when they are cut and smoothed in Blender."""

from pathlib import Path

import numpy as np
import pytest

from stereocell.cli.__main__ import main
from support import phantoms
from support.blender_session import NEEDS_BLENDER, run

pytestmark = NEEDS_BLENDER

_RADIUS_UM = 12.0


@pytest.fixture(scope="module")
def tile(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the layer of a tile with one ball, whose levels of detail have UVs and maps."""
    folder = tmp_path_factory.mktemp("maps")
    spacing = (1.0, 1.0, 1.0)
    ball = phantoms.blurred_ball((40, 40, 40), spacing, (20.0, 20.0, 20.0), _RADIUS_UM, 1.0)
    source, out = folder / "ball.ome.tif", folder / "out"
    voxels = phantoms.as_counts(ball, 100, 1100)[np.newaxis]
    phantoms.write_ome_tiff(source, voxels, "CZYX", spacing, names=["body"])
    flags = ["--maps", "--iso-value", "body=600"]
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    for phase in ("units", "stage"):
        assert main([phase, str(out), "--workers", "0"]) == 0
    return out / "stage/tiles/r0_c0/tile.usdc"


def test_a_box_is_cut_out_of_a_surface_with_maps_and_nothing_tears(
    tile: Path, tmp_path: Path
) -> None:
    (found,) = run("carve", tmp_path, tile=tile).values()
    assert found["uvs"][0] == "st"
    assert set(found["before"]["edges"]) == {"2"}
    whole = found["before"]["volume"]
    assert whole == pytest.approx(4 / 3 * np.pi * _RADIUS_UM**3, rel=0.05)
    assert set(found["cut"]["edges"]) == set(found["smoothed"]["edges"]) == {"2"}
    # The box has one corner at the ball's centre, so it cuts off an eighth of the ball.
    assert found["cut"]["volume"] == pytest.approx(7 / 8 * whole, rel=0.03)
