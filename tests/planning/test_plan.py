"""Plans: levels, regions, tiles and halo, and settings that don't fit the data."""

import dataclasses
import json
import tomllib

import jsonschema
import numpy as np
import pytest

from stereocell.model.errors import SourceError, StereoCellError, UsageError
from stereocell.planning import settings as settings_module
from stereocell.planning.channels import Channel
from stereocell.planning.plan_file import from_json, to_json
from stereocell.read import Level
from stereocell.storage.assets import find_asset
from support.plans import CHANNELS, plan_of
from support.sealed_files import seal


def test_a_plan_read_from_its_file_is_the_same_and_passes_its_schema() -> None:
    plan = plan_of({"grid": "5x2"}, iso_values={"CD3ε": 700.0})
    content = json.loads(json.dumps(to_json(plan)))
    schema = json.loads(find_asset("schemas/plan.schema.json").read_text("utf-8"))
    jsonschema.validate(seal(content), schema)
    assert from_json(content) == plan
    assert len(plan.tiles) == 10


def test_without_a_level_the_finest_within_the_limit_is_chosen_and_reported() -> None:
    plan = plan_of({"max_voxels": 2 * 64 * 128 * 320})
    assert plan.level == 1
    assert plan.spacing_um == (0.28, 0.28, 0.28)
    assert "5,242,880" in plan.level_reason
    assert plan_of().level == 0
    with pytest.raises(UsageError, match="coarsest level holds"):
        plan_of({"max_voxels": 10})


def test_the_limit_counts_the_region_of_the_level_that_is_built() -> None:
    limit = {"max_voxels": 2 * 64 * 100 * 100}
    assert plan_of({"region": ":,0:100,:100", **limit}).level == 0
    # an open end means the end of the level: 640 columns at level 0, 320 at level 1, 160 at level 2
    assert plan_of({"region": ":,0:60,:", **limit}).level == 2
    assert plan_of({"region": ":,0:30,:", **limit}).level == 1
    with pytest.raises(
        UsageError, match=r"--region :,0:200,:300 holds 7,680,000 voxels, more than"
    ):
        plan_of({"region": ":,0:200,:300", **limit})  # no coarser level can hold this region


def test_the_halo_covers_all_voxels_that_influence_a_result() -> None:
    plan = plan_of()
    reach = plan.repair.reach_um(plan.spacing_um)
    reach += 4 * plan.settings.surface.smoothing_um  # type: ignore[operator]
    for voxels, step in zip(plan.halo, plan.spacing_um, strict=True):
        assert voxels * step >= reach + step


def test_tiles_are_clipped_to_the_data() -> None:
    assert plan_of().settings.plan.tile_size == (64, 256, 512)
    assert [tile.id for tile in plan_of().tiles] == ["r0_c0", "r0_c1"]


def test_planning_again_with_the_resulting_settings_gives_the_same_plan() -> None:
    plan = plan_of({"grid": "4x3", "region": ":,0:10,0:9"})
    sizes = {tile.box.shape for tile in plan.tiles}
    assert len(plan.tiles) == 12
    assert sizes == {(64, 3, 2), (64, 3, 3), (64, 4, 2), (64, 4, 3)}
    assert (plan.settings.plan.grid, plan.settings.plan.tile_size) == ("4x3", (64, 4, 3))
    assert from_json(json.loads(json.dumps(to_json(plan)))) == plan
    used = tomllib.loads(settings_module.to_toml(plan.settings))
    again = plan_of(used.pop("plan"), **used)
    assert dataclasses.replace(again, level_reason=plan.level_reason) == plan


@pytest.mark.parametrize("preset", ["cycif", "lightsheet", None])
def test_lengths_that_suit_the_voxels_make_a_plan(preset: str | None) -> None:
    surface = settings_module.load(preset, None, flags={}).surface
    plan_of(surface=dataclasses.asdict(surface))


@pytest.mark.parametrize(
    ("preset", "level"),
    [
        ("mri", Level((256, 320, 320), (1000.0, 800.0, 800.0))),
        ("lightsheet", Level((300, 900, 900), (5.0, 2.0, 2.0))),
        (None, Level((100, 1500, 1500), (5.0, 0.3, 0.3))),  # strongly anisotropic
    ],
)
def test_presets_and_defaults_suit_their_data(preset: str | None, level: Level) -> None:
    settings = settings_module.to_dict(settings_module.load(preset, None, flags={}))
    plan_of(settings.pop("plan"), levels=(level,), channels=CHANNELS[:1], **settings)


@pytest.mark.parametrize("preset", ["ct", "ct-bone", "mri"])
@pytest.mark.parametrize(
    ("rows", "flags", "tiles"), [(512, {}, 1), (611, {}, 2), (611, {"tile_size": [768] * 3}, 1)]
)
def test_a_body_of_up_to_512_voxels_a_side_is_one_tile_unless_a_size_is_given(
    preset: str, rows: int, flags: dict[str, object], tiles: int
) -> None:
    settings = settings_module.to_dict(settings_module.load(preset, None, flags={}))
    level = Level((60, rows, 512), (3000.0, 800.0, 800.0))
    asked = settings.pop("plan") | flags
    found = plan_of(asked, levels=(level,), channels=CHANNELS[:1], **settings)
    assert len(found.tiles) == tiles


@pytest.mark.parametrize(
    "surface",
    [
        {
            "alpha_um": 1000.0,
            "min_diagonal_um": 10000.0,
            "max_cavity_um": 4000.0,
        },  # lengths of the preset mri
        {"alpha_um": 200.0},
        {"smoothing_um": 100.0},
        {"alpha_um": 1e12},
    ],
)
def test_lengths_for_larger_voxels_are_wrong_usage(surface: dict[str, object]) -> None:
    with pytest.raises(UsageError) as raised:
        plan_of({"grid": "5x2"}, surface=surface)
    message = str(raised.value)
    assert f"alpha_um = {surface.get('alpha_um', 0.56):g} um" in message
    assert "make a tile of 64 x 128 x 128 voxels read" in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("unwrap", "message"),
    [
        ({"texel_um": 1e-6}, "texel_um is 1e-06, expected at least 0.014 (the finest voxel"),
        ({"texel_um": 0.0}, "texel_um is 0, expected at least 0.014"),
        ({"occlusion_um": 1e9}, "occlusion_um is 1e+09, expected at most 17.92 (64 times the"),
        ({"paint_um": 18.0}, "paint_um is 18, expected at most 17.92"),
    ],
)
def test_lengths_of_maps_that_would_exhaust_the_machine_are_wrong_usage(
    unwrap: dict[str, object], message: str
) -> None:
    with pytest.raises(UsageError) as raised:
        plan_of(unwrap=unwrap)
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)


def test_lengths_of_maps_at_their_limits_make_a_plan() -> None:
    at_limit = {"texel_um": 0.014, "occlusion_um": 17.92, "paint_um": 17.92, "padding": 24}
    assert plan_of(unwrap=at_limit).settings.unwrap.texel_um == 0.014


@pytest.mark.parametrize(
    ("grid_um", "message"),
    [
        (1e9, "grid_um is 1e+09, which leaves 1 of the 64 planes along z of a tile, 0.28 um apart"),
        (7.0, "leaves 3 of the 64 planes along z of a tile"),
        (-1.0, "surface.grid_um is -1.0, expected a length in um, 0 to 1e+12"),
    ],
)
def test_planes_too_far_apart_for_a_tile_are_wrong_usage(grid_um: float, message: str) -> None:
    with pytest.raises(UsageError) as raised:
        plan_of(surface={"grid_um": grid_um})
    assert message in str(raised.value)
    assert "auto" not in str(raised.value)


def test_a_grid_with_four_planes_in_a_tile_makes_a_plan() -> None:
    assert plan_of(surface={"grid_um": 16 * 0.28}).step == (16, 32, 32)
    thin = {"region": "0:3,:,:"}
    # The region has only three planes along z, and all of them carry the surface.
    assert plan_of(thin, surface={"grid_um": 0.28}).step == (1, 2, 2)


def test_long_lengths_are_accepted_if_a_unit_reads_few_voxels() -> None:
    surface: dict[str, object] = {"min_diagonal_um": 10000.0}
    assert plan_of({"region": "0:16,0:48,0:36"}, surface=surface).halo == (20, 52, 40)
    endless: dict[str, object] = {"min_diagonal_um": 1e12, "max_cavity_um": 1e12}
    assert plan_of({"region": "0:16,0:48,0:36"}, surface=endless).halo == (20, 52, 40)
    wide = (Level((64, 3000, 3000), (0.28, 0.14, 0.14)),)
    with pytest.raises(UsageError, match="make a tile of 64 x 512 x 512 voxels read"):
        plan_of(levels=wide, surface=surface)


def test_region_may_leave_ends_open() -> None:
    plan = plan_of({"region": "0:10,:,100:"})
    assert plan.region.start == (0, 0, 100)
    assert plan.region.stop == (10, 256, 640)


def test_positions_are_voxel_centres() -> None:
    np.testing.assert_allclose(plan_of().position_um((1, 2, 3)), (0.28, 0.28, 0.42))


@pytest.mark.parametrize(
    ("flags", "message"),
    [
        ({"level": 3}, "--level is 3, expected 0 to 2"),
        ({"region": "1:2"}, "--region is '1:2', expected z0:z1,y0:y1,x0:x1"),
        ({"region": "0:99,:,:"}, "expected a box inside 64 x 256 x 640"),
        ({"region": "9:5,:,:"}, "expected a box inside"),
        ({"grid": "5by2"}, "--grid is '5by2', expected columns x rows"),
        ({"grid": "0x2"}, "expected columns x rows"),
        ({"grid": "00x2"}, "expected columns x rows"),
        ({"grid": "400x2"}, "makes more tiles than 256 x 640 voxels"),
        ({"tile_size": [1, 5, 5]}, "--tile-size is [1, 5, 5], expected three numbers"),
        ({"tile_size": [5, 5]}, "expected three numbers"),
    ],
)
def test_settings_that_do_not_fit_the_data_are_wrong_usage(
    flags: dict[str, object], message: str
) -> None:
    with pytest.raises(UsageError) as raised:
        plan_of(flags)
    assert message in str(raised.value)


def test_a_single_plane_can_not_be_built() -> None:
    with pytest.raises(SourceError, match="expected at least 2 along each axis"):
        plan_of({"region": "3:4,:,:"})


def test_an_iso_value_for_an_unknown_channel_lists_the_known_ones() -> None:
    with pytest.raises(StereoCellError, match="'CD4', expected one of Hoechst 33342, CD3ε"):
        plan_of(iso_values={"CD4": 3.0})


def test_iso_values_are_given_by_name_or_by_index() -> None:
    assert plan_of(iso_values={"2": 3.0}).settings.iso_values == {"CD3ε": 3.0}
    plan = plan_of(iso_values={"Hoechst 33342": 1.0, "2": 3.0})
    assert plan.settings.iso_values == {"Hoechst 33342": 1.0, "CD3ε": 3.0}
    with pytest.raises(UsageError, match=r"channel '1', expected one of .*, or an index of 0, 2"):
        plan_of(iso_values={"1": 3.0})
    with pytest.raises(UsageError, match="'CD3ε' by name and by index"):
        plan_of(iso_values={"2": 3.0, "CD3ε": 4.0})


def test_the_star_stands_for_channels_without_a_key_of_their_own() -> None:
    """Presets for CT use the star, so that users may name the channel in any way."""
    stars = {"iso_values": {"*": -300.0}, "windows": {"*": "-1024:2000"}}
    for key in ("CD3ε", "2"):
        plan = plan_of(
            iso_values=stars["iso_values"] | {key: 3.0}, windows={"*": "1:2", key: "3:4"}
        )
        assert plan.settings.iso_values == {"Hoechst 33342": -300.0, "CD3ε": 3.0}
        assert plan.settings.windows == {"Hoechst 33342": "1:2", "CD3ε": "3:4"}
    for preset in ("ct", "ct-bone"):
        loaded = settings_module.load(preset, None, flags={"windows": {"2": "brain"}})
        assert list(loaded.windows) == ["*", "2"]


def test_each_of_several_surfaces_can_be_named() -> None:
    outer, inner = (
        Channel(0, f"CT {level}", (1, 1, 1), level=level, base="CT") for level in ("outer", "inner")
    )
    other = Channel(1, "PET", (1, 0, 0))
    plan = plan_of(channels=(outer, inner, other), paint={"CT outer": "PET", "PET": "CT"})
    assert plan.settings.paint == {"CT outer": "PET", "PET": "CT outer"}
    with pytest.raises(UsageError, match="several surfaces, expected one of CT outer, CT inner"):
        plan_of(channels=(outer, inner, other), paint={"CT": "PET"})


def test_a_key_counts_as_a_name_before_it_counts_as_an_index() -> None:
    channels = (Channel(0, "488", (0, 0, 1)), Channel(1, "0", (0, 1, 0)))
    plan = plan_of(channels=channels, iso_values={"0": 5.0})
    assert plan.settings.iso_values == {"0": 5.0}


def test_plan_is_frozen() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        plan_of().level = 2  # type: ignore[misc]
