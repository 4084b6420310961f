"""Plans: levels, regions, tiles, halo; and what doesn't fit the data."""

import dataclasses
import json

import jsonschema
import numpy as np
import pytest

from stereocell import config
from stereocell.assets import find_asset
from stereocell.errors import SourceError, StereoCellError, UsageError
from stereocell.plan import Channel, choose_level, from_json, make_plan, to_json
from stereocell.read import Level

LEVELS = (
    Level((64, 256, 640), (0.28, 0.14, 0.14)),
    Level((64, 128, 320), (0.28, 0.28, 0.28)),
    Level((64, 64, 160), (0.28, 0.56, 0.56)),
)
CHANNELS = (Channel(0, "Hoechst 33342", (0, 0, 1)), Channel(2, "CD3ε", (0, 1, 0)))


def _plan(flags: dict[str, object] | None = None, **sections: dict[str, object]):
    settings = config.load(None, None, {"plan": flags or {}, **sections})
    level = choose_level(LEVELS, len(CHANNELS), settings)
    return make_plan(
        "in.ome.zarr", "in", "ab" * 32, LEVELS, (0.0, 0.0, 0.0), CHANNELS, level, settings
    )


def test_plan_survives_its_file_and_passes_its_schema() -> None:
    plan = _plan({"grid": "5x2"}, iso_values={"CD3ε": 700.0})
    content = json.loads(json.dumps(to_json(plan)))
    jsonschema.validate(content, json.loads(find_asset("schemas/plan.schema.json").read_text()))
    assert from_json(content) == plan
    assert len(plan.tiles) == 10


def test_without_a_level_the_finest_within_the_limit_is_taken_and_said() -> None:
    plan = _plan({"max_voxels": 2 * 64 * 128 * 320})
    assert plan.level == 1
    assert plan.spacing_um == (0.28, 0.28, 0.28)
    assert "5,242,880" in plan.level_reason
    assert _plan().level == 0
    with pytest.raises(UsageError, match="coarsest level holds"):
        _plan({"max_voxels": 10})


def test_halo_covers_what_decides_on_a_voxel() -> None:
    plan = _plan()
    reach = plan.repair.reach_um(plan.spacing_um)
    reach += 4 * plan.settings.surface.smoothing_um  # type: ignore[operator]
    for voxels, step in zip(plan.halo, plan.spacing_um, strict=True):
        assert voxels * step >= reach + step


def test_tiles_are_clipped_to_the_data() -> None:
    assert _plan().settings.plan.tile_size == (64, 256, 512)
    assert [tile.id for tile in _plan().tiles] == ["r0_c0", "r0_c1"]


def test_region_may_leave_ends_open() -> None:
    plan = _plan({"region": "0:10,:,100:"})
    assert plan.region.start == (0, 0, 100)
    assert plan.region.stop == (10, 256, 640)


def test_positions_are_voxel_centres() -> None:
    np.testing.assert_allclose(_plan().position_um((1, 2, 3)), (0.28, 0.28, 0.42))


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        ({"level": 3}, "--level is 3, expected 0 to 2"),
        ({"region": "1:2"}, "--region is '1:2', expected z0:z1,y0:y1,x0:x1"),
        ({"region": "0:99,:,:"}, "expected a box inside 64 x 256 x 640"),
        ({"region": "9:5,:,:"}, "expected a box inside"),
        ({"grid": "5by2"}, "--grid is '5by2', expected columns x rows"),
        ({"grid": "0x2"}, "expected columns x rows"),
        ({"grid": "400x2"}, "makes more tiles than 256 x 640 voxels"),
        ({"tile_size": [1, 5, 5]}, "--tile-size is [1, 5, 5], expected three numbers"),
        ({"tile_size": [5, 5]}, "expected three numbers"),
    ],
)
def test_what_does_not_fit_is_wrong_usage(flags: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError) as raised:
        _plan(flags)
    assert message in str(raised.value)


def test_single_plane_can_not_be_built() -> None:
    with pytest.raises(SourceError, match="expected at least 2 each way"):
        _plan({"region": "3:4,:,:"})


def test_iso_value_for_an_unknown_channel_names_the_known() -> None:
    with pytest.raises(StereoCellError, match="'CD4', expected one of Hoechst 33342, CD3ε"):
        _plan(iso_values={"CD4": 3.0})


def test_plan_is_frozen() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        _plan().level = 2  # type: ignore[misc]
