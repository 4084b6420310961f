"""Settings: presets, files and flags, and errors in them."""

import re
import tomllib
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from stereocell.model.errors import UsageError
from stereocell.model.settings import MAX_VOXEL_VALUE
from stereocell.planning import settings as settings_module
from stereocell.planning.settings import Settings
from stereocell.read import Level
from stereocell.read.dataset import MAX_VALUE
from support.plans import plan_of


def test_reading_the_printed_settings_gives_the_defaults() -> None:
    text = settings_module.to_toml(settings_module.Settings())
    assert (
        settings_module.apply(settings_module.Settings(), tomllib.loads(text), "here")
        == settings_module.Settings()
    )
    keys = [line for line in text.splitlines() if " = " in line and not line.startswith("#")]
    assert keys
    assert all("  # " in line for line in keys)


def test_the_header_states_whether_the_file_is_meant_to_be_edited() -> None:
    template = settings_module.to_toml(settings_module.Settings(), header=settings_module.TEMPLATE)
    assert template.startswith("# StereoCell settings. Every key may be left out")
    record = settings_module.to_toml(settings_module.Settings())
    assert record.startswith("# The settings that this build used")
    assert "copy this file and pass the copy with --config" in record
    assert tomllib.loads(record) == tomllib.loads(template)


def test_any_channel_name_is_read_back_from_the_file() -> None:
    odd = 'a"b\\c\n\t\x00\x7f\u6f22'
    settings = settings_module.apply(settings_module.Settings(), {"iso_values": {odd: 1.5}}, "here")
    assert settings_module.from_dict(tomllib.loads(settings_module.to_toml(settings))) == settings


def test_a_later_tile_size_replaces_an_earlier_grid(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text('[plan]\ngrid = "5x2"\ntile_size = [64, 100, 100]\n')
    assert settings_module.load("mri", file, flags={}).plan.grid == "5x2"
    plan = settings_module.load(None, file, flags={"plan": {"tile_size": [8, 9, 9]}}).plan
    assert (plan.grid, plan.tile_size) == ("", (8, 9, 9))


@pytest.mark.parametrize("preset", ["cycif", "lightsheet", "mri"])
def test_presets_load(preset: str) -> None:
    settings = settings_module.load(preset, None, flags={})
    assert settings != settings_module.Settings()
    assert settings_module.from_dict(settings_module.to_dict(settings)) == settings


def test_flags_override_the_file_and_the_file_overrides_the_preset(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text("[window]\nlow_percentile = 3\n[surface]\nalpha_um = 2.5\n[plan]\nlevel = 1\n")
    settings = settings_module.load("cycif", file, flags={"plan": {"level": 2}})
    assert settings.plan.level == 2
    assert settings.window.low_percentile == 3.0
    assert settings.surface.alpha_um == 2.5
    assert settings.surface.body_um == 1.5  # from the preset


def test_a_user_s_own_preset_is_a_toml_file(tmp_path: Path) -> None:
    file = tmp_path / "ours.toml"
    file.write_text('[isovalue]\ncriterion = "pekar-mean"\n[iso_values]\n"Hoechst 33342" = 800\n')
    settings = settings_module.load(str(file), None, flags={})
    assert settings.isovalue.criterion == "pekar-mean"
    assert settings.iso_values == {"Hoechst 33342": 800.0}
    assert settings_module.from_dict(tomllib.loads(settings_module.to_toml(settings))) == settings


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[plan]\nlevle = 1\n", "unknown key 'levle'; did you mean 'level'"),
        ("[sufaces]\n", "unknown section 'sufaces'; did you mean 'surfaces'"),
        ('[iso_values]\nCD31 = "90+c"\n', "iso_values.CD31 is '90+c', expected a voxel value"),
        ('[isovalue]\nscope = "slide"\n', "isovalue.scope is 'slide', expected one of channel"),
        ('[isovalue]\nlevel = "4"\n', "isovalue.level is '4', expected one of outer, inner"),
        ("[plan]\nlevel = 1.5\n", "plan.level is 1.5, expected a whole number or 'auto'"),
        ("[window]\nlow_percentile = true\n", "low_percentile is True, expected a number"),
        ("[window]\nlow_percentile = 100\n", "expected 0 <= low < high <= 100"),
        ("[isovalue]\nbins = 3\n", "bins is 3, expected 16 to 65536"),
        ("[plan]\nchannels = 3\n", "channels is 3, expected a list"),
        ("[plan]\nmax_voxels = 0\n", "plan.max_voxels is 0, expected 1 or more"),
        ("[plan]\ntime = -1\n", "plan.time is -1, expected 0 or more"),
        ("[plan]\nspacing_um = [1, 0, 1]\n", "spacing_um is 1,0,1, expected z,y,x in um"),
        ("[plan]\nspacing_um = [1, 2]\n", "spacing_um is 1,2, expected z,y,x in um"),
        ('[plan]\nmodality = "MRI"\n', "plan.modality is 'MRI', expected one of AR, AU, BDUS"),
        ("[surface]\nclosed_tiles = 1\n", "closed_tiles is 1, expected true or false"),
        ("[surface]\nwrap = 3\n", "surface.wrap is 3, expected text"),
        ('[surface]\ngrid_um = "auto"\n', "surface.grid_um is 'auto', expected a number"),
        ("[surface]\nalpha_um = true\n", "alpha_um is True, expected a number or 'auto'"),
        ("[unwrap]\npadding = 1.5\n", "unwrap.padding is 1.5, expected a whole number"),
        ("[unwrap]\npadding = 200\n", "unwrap.padding is 200, expected 3 to 24"),
        ("plan = 3\n", "plan is 3, expected a table"),
        ("[surface]\ngrid_um = 1e308\n", "grid_um is 1e+308, expected a length in um, 0"),
        ("[surface]\nalpha_um = 1e13\n", "alpha_um is 10000000000000.0, expected a length in"),
        (
            "[lod]\nsamples = 99999999999999999999\n",
            "lod.samples is 99999999999999999999, expected",
        ),
        ("[lod]\nerrors = [1.0, 1e300]\n", "lod.errors is 1e+300, expected 0 to 1e+06"),
        ("[iso_values]\nCD31 = 1e300\n", "iso_values.CD31 is 1e+300, expected a voxel value"),
        ('[windows]\nCD31 = "-3e38:3e38"\n', "windows.CD31 is '-3e38:3e38', expected LOW:HIGH"),
        ("[plan\n", "not TOML"),
    ],
)
def test_wrong_settings_are_one_clear_line(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text)
    with pytest.raises(UsageError) as raised:
        settings_module.load(None, file, flags={})
    assert message in str(raised.value)
    assert str(raised.value).startswith(f"{file}: ")
    assert ("'auto'" in str(raised.value)) == ("'auto'" in message)
    assert "\n" not in str(raised.value)


def test_an_unknown_preset_lists_the_known_ones() -> None:
    with pytest.raises(
        UsageError,
        match=r"one of ct, ct-bone, cycif, em, lightsheet, mri, pet, vessels or a \.toml file",
    ):
        settings_module.load("confocal", None, flags={})


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"none\.toml: No such file"):
        settings_module.load(None, tmp_path / "none.toml", flags={})


@pytest.mark.parametrize("preset", [None, "ct", "ct-bone", "mri"])
@pytest.mark.parametrize("pixel_um", [488.0, 900.0, 1000.0])
def test_an_object_of_20_mm_is_not_a_fragment_in_a_head_of_thick_slices(
    preset: str | None, pixel_um: float
) -> None:
    surface = settings_module.load(preset, None, flags={}).surface
    resolved = surface.resolved((6500.0, pixel_um, pixel_um))
    assert float(resolved.min_diagonal_um) <= 20_000
    assert float(resolved.max_fragment_um) <= 20_000
    # a speck of one voxel is a fragment even in a thick slice
    assert float(resolved.min_diagonal_um) > np.hypot(6500.0, np.hypot(pixel_um, pixel_um))


@pytest.mark.parametrize("preset", ["ct", "ct-bone", "mri"])
@pytest.mark.parametrize(
    ("spacing_um", "field_um", "expected_um"),
    [
        (500.0, 250_000.0, 10_000.0),  # a head, with the preset's own size
        (200.0, 60_000.0, 3_000.0),  # a finger, with a twentieth of its length
        (
            100.0,
            5_000.0,
            300.0,
        ),  # a mouse's paw, with three voxels, which are more than a twentieth
    ],
)
def test_a_preset_s_smallest_object_is_bounded_by_the_field_of_view(
    preset: str, spacing_um: float, field_um: float, expected_um: float
) -> None:
    surface = settings_module.load(preset, None, flags={}).surface
    resolved = surface.resolved((spacing_um,) * 3, field_um)
    assert resolved.min_diagonal_um == pytest.approx(expected_um)
    assert float(resolved.max_fragment_um) <= 2 * expected_um


def test_a_size_given_by_the_user_applies_to_any_field_of_view() -> None:
    flags = {"surface": {"min_diagonal_um": 10_000.0}}
    surface = settings_module.load("ct", None, flags=flags).surface
    assert surface.resolved((100.0, 100.0, 100.0), 5_000.0).min_diagonal_um == 10_000.0


@pytest.mark.parametrize("region", ["", "0:20,0:20,0:20"])
def test_the_sizes_for_a_region_are_those_of_the_whole_field_of_view(region: str) -> None:
    level = Level((40, 40, 100), (1.0, 1.0, 1.0))
    plan = plan_of({"region": region}, (level,), surface={"body_um": 50.0})
    assert plan.settings.surface.min_diagonal_um == 5.0


def test_auto_lengths_of_cubic_voxels_are_multiples_of_the_spacing() -> None:
    resolved = settings_module.SurfaceOptions().resolved((2.0, 1.0, 1.0))
    assert (resolved.min_diagonal_um, resolved.max_fragment_um) == (6.0, 12.0)
    assert resolved.max_cavity_um == 8.0


def test_auto_lengths_follow_the_spacing() -> None:
    resolved = settings_module.SurfaceOptions().resolved((5.0, 2.0, 2.0))
    assert (resolved.smoothing_um, resolved.max_alpha_um) == (2.0, 10.0)
    assert resolved.alpha_um == "auto"  # chosen later by the channel's components
    with pytest.raises(UsageError, match="alpha_um is -1"):
        settings_module.SurfaceOptions(alpha_um=-1.0).resolved((1.0, 1.0, 1.0))


def test_an_endless_whole_number_is_wrong_usage(tmp_path: Path) -> None:
    file = tmp_path / "huge.toml"
    file.write_text("[isovalue]\nmin_area_share = " + "9" * 400)
    with pytest.raises(UsageError, match=r"isovalue\.min_area_share is 9"):
        settings_module.load(None, file, flags={})


NUMBERS = [
    (section.name, field.name)
    for section in fields(Settings())
    if is_dataclass(getattr(Settings(), section.name))
    for field in fields(getattr(Settings(), section.name))
    if {int, float} & {field.type, *get_args(field.type)}
]


def test_each_section_has_numbers() -> None:
    assert {section for section, _ in NUMBERS} >= {"plan", "surface", "lod", "objects", "unwrap"}


@pytest.mark.parametrize(("section", "key"), NUMBERS)
@pytest.mark.parametrize("value", [10**20, -(10**20)])
def test_each_number_has_bounds(section: str, key: str, value: int) -> None:
    default = getattr(getattr(Settings(), section), key)
    given = [value, value, value] if isinstance(default, tuple) else value
    with pytest.raises(UsageError) as raised:
        settings_module.apply(Settings(), {section: {key: given}}, "here")
    assert re.match(rf"{section}[. ]({key}|percentiles)", str(raised.value))


def test_voxel_values_in_settings_and_inputs_have_the_same_bound() -> None:
    assert MAX_VOXEL_VALUE == MAX_VALUE


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ({"plan": {"grid": "\udcff"}}, "here: plan.grid is '\\xff', expected text in UTF-8"),
        ({"plan": {"channels": ["a", "\udce9"]}}, "here: plan.channels is '\\xe9', expected text"),
        ({"iso_values": {"\ud800": 1.0}}, "here: iso_values.\\ud800 is '\\ud800', expected text"),
    ],
)
def test_texts_that_are_not_utf8_are_reported(values: dict[str, object], expected: str) -> None:
    with pytest.raises(UsageError) as raised:
        settings_module.apply(Settings(), values, "here")
    assert str(raised.value).startswith(expected)
