"""The transfer function that a channel opens with fits the channel's surface."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from stereocell.isosurface.options import parse_level
from stereocell.isosurface.repair_options import RepairOptions
from stereocell.model.channel import Appearance, SurfaceLevel
from stereocell.planning.channels import MR_GREY, Channel, has_brain
from stereocell.planning.settings import load, preset_names
from stereocell.planning.survey import ChannelSurvey
from stereocell.planning.vessel_color import VESSEL_RED, color_vessels
from stereocell.transfer.channel_statistics import find_statistics, make_appearance
from stereocell.transfer.opacity import evaluate
from stereocell.transfer.shapes2d import evaluate2d
from stereocell.transfer.windows import parse_window
from support.plans import plan_of


def _body_in_hounsfield_units(rng: np.random.Generator) -> NDArray[np.float64]:
    """Return air, fat, soft tissue and bone, with the voxels between air and skin."""
    parts = [(-1000, 60_000), (-100, 10_000), (40, 30_000), (700, 5_000)]
    tissue = [rng.normal(hu, 15, count) for hu, count in parts]
    return np.concatenate([*tissue, rng.uniform(-1000, 40, 4_000)])


def _magnitudes(rng: np.random.Generator) -> NDArray[np.float64]:
    return np.concatenate([rng.rayleigh(12, 60_000), rng.normal(220, 30, 40_000)])


def _light(rng: np.random.Generator) -> NDArray[np.float64]:
    return np.concatenate([rng.poisson(100, 90_000), rng.normal(900, 120, 10_000)])


def _uptake(rng: np.random.Generator) -> NDArray[np.float64]:
    return np.concatenate([rng.gamma(1.2, 150, 90_000), rng.normal(4000, 500, 5_000)])


# voxels, the level of their surface if no preset states it, and the level of their background
CASES: dict[str, tuple[Callable[[np.random.Generator], NDArray[np.float64]], float, float]] = {
    "CT": (_body_in_hounsfield_units, -300.0, -1000.0),
    "MR": (_magnitudes, 90.0, 15.0),
    "PT": (_uptake, 1500.0, 200.0),
    "": (_light, 450.0, 100.0),
}
MOST_BELOW_HU = 60.0  # HU; most that a CT's opacity may begin below its surface


def _opened(
    preset: str, *, is_hounsfield: bool = True, unevenness: float = 1.0
) -> tuple[Appearance, float]:
    """Return the appearance of a channel for a preset, and the level of its background."""
    settings = load(preset, None, flags={})
    make, level, background = CASES[settings.plan.modality]
    if "*" in settings.iso_values:
        level = parse_level("iso-value", settings.iso_values["*"])[0]
    window = None
    if "*" in settings.windows:
        window = parse_window("window", settings.windows["*"])
    statistics = find_statistics(make(np.random.default_rng(0)), settings.window, window=window)
    appearance = make_appearance(
        "Channel",
        (1, 1, 1),
        statistics=statistics,
        level=SurfaceLevel(level, None, 1.0),
        confidence=1.0,
        why_unclear="",
        modality=settings.plan.modality,
        is_hounsfield=is_hounsfield,
        unevenness=unevenness,
    )
    return appearance, background


def _foot(appearance: Appearance) -> float:
    """Return the voxel value at which the opacity of the chosen function begins."""
    opacity = evaluate(appearance.transfer_functions[appearance.function], size=4096)
    low, high = appearance.window
    return low + float(np.flatnonzero(opacity > 0)[0]) / 4095 * (high - low)


@pytest.mark.parametrize("preset", preset_names())
def test_the_opacity_of_a_preset_s_function_begins_at_the_surface(preset: str) -> None:
    appearance, background = _opened(preset)
    assert appearance.iso_value is not None
    lowest = (background + appearance.iso_value) / 2
    if preset.startswith("ct"):
        lowest = appearance.iso_value - MOST_BELOW_HU
    step = (
        appearance.window[1] - appearance.window[0]
    ) / 4095  # voxel values between two entries of the table
    assert lowest <= _foot(appearance) <= appearance.iso_value + step


def test_a_surface_of_bone_opens_with_the_transfer_function_for_bone() -> None:
    assert _opened("ct-bone")[0].function == "bone"
    assert _opened("ct")[0].function == "tissues"
    assert _opened("mri")[0].function == "grey"


def _color_at(appearance: Appearance, hu: float, step_hu: float) -> tuple[NDArray[np.float64], int]:
    """Return colour and opacity, 0..255, of the opening function at a value and a step."""
    table = evaluate2d(appearance.transfer_2d.functions[appearance.function])
    low, high = appearance.window
    rows, columns = table.shape[:2]
    row = step_hu / (high - low) / appearance.transfer_2d.gradient_max * (rows - 1)
    cell = table[min(round(row), rows - 1), round((hu - low) / (high - low) * (columns - 1))]
    return cell[:3] / 255, int(cell[3])


def test_tissues_of_a_ct_differ_in_colour_and_their_edge_to_air_looks_like_skin() -> None:
    appearance, _ = _opened("ct")
    fat, muscle, bone = (_color_at(appearance, hu, 0.0)[0] for hu in (-100, 50, 900))
    assert min(fat[:2]) > 0.8  # yellow
    assert fat[2] < 0.7
    assert muscle[0] > 2 * max(muscle[1:])  # red
    assert min(bone) > 0.95  # the channel's own pale colour
    # bile, liver, muscle and contrast medium can be distinguished on a cut
    steps = [_color_at(appearance, hu, 0.0) for hu in (0, 35, 65, 120)]
    assert (np.diff([color @ (0.2126, 0.7152, 0.0722) for color, _ in steps]) > 0.04).all()
    opacities = [opacity for _, opacity in steps]
    assert max(opacities) - min(opacities) < 0.12 * max(opacities)
    skin = [_color_at(appearance, hu, 900.0)[0] for hu in (-290, -100, 50)]
    assert all(min(color) > 0.8 for color in skin)
    assert _color_at(appearance, -600, 900.0)[1] == 0


def test_brighter_tissue_of_an_mr_is_lighter_without_amplifying_noise() -> None:
    appearance, _ = _opened("mri")
    assert appearance.iso_normalized is not None
    table = evaluate2d(appearance.transfer_2d.functions["grey"])
    columns = table.shape[1]
    inner = table[0, int(1.2 * appearance.iso_normalized * columns) :]
    light = inner[inner[:, 3] > 0][:, 0].astype(int)
    assert (np.diff(light) >= -2).all()
    assert light[-1] > 2 * light[0]
    general = evaluate(appearance.transfer_functions["default"])
    air = slice(0, int(0.8 * appearance.iso_normalized * columns))
    assert (table[0, air, 3] / 255 <= general[air] + 0.03).all()


def test_a_ct_of_thick_slices_opens_in_one_colour() -> None:
    appearance, _ = _opened("ct", unevenness=8.0)
    assert appearance.function == "default"
    assert "tissues" in appearance.transfer_functions


def test_a_ct_without_hounsfield_units_has_no_colours_by_tissue() -> None:
    assert "tissues" not in _opened("ct", is_hounsfield=False)[0].transfer_functions


def test_a_ct_is_opaque_just_inside_its_skin() -> None:
    appearance, _ = _opened("ct")
    opacity = evaluate(appearance.transfer_functions["default"])
    low, high = appearance.window
    at = {hu: float(opacity[round(255 * (hu - low) / (high - low))]) for hu in (-700, -345, -100)}
    assert at[-700] == at[-345] == 0
    assert at[-100] > 0.4


def test_an_mr_opens_with_a_cut_unless_classes_of_a_brain_are_found() -> None:
    plain = replace(plan_of(), modality="MR")
    assert plain.opens_cut
    assert not replace(plain, modality="CT").opens_cut
    assert not plan_of().opens_cut
    head = [
        Channel(index, name, (1, 1, 1), source="classes.ome.zarr")
        for index, name in enumerate(("CSF", "grey matter", "white matter"))
    ]
    assert not replace(plain, channels=(*plain.channels, *head)).opens_cut
    assert replace(plain, channels=(*plain.channels, *head[:2])).opens_cut
    # the input's own channel may be named like a class
    assert not has_brain([replace(one, source="") for one in head])


@pytest.mark.parametrize(("enclosed", "is_body"), [(0.01, False), (0.2, True)])
def test_only_bodies_are_cut_open_and_vessels_are_shown_whole_and_red(
    enclosed: float, is_body: bool
) -> None:
    rng = np.random.default_rng(0)
    inside = round(100_000 * enclosed)
    voxels = np.concatenate([rng.rayleigh(12, 100_000 - inside), rng.normal(220, 30, inside)])
    statistics = find_statistics(voxels, load("mri", None, flags={}).window)
    look = make_appearance(
        "MR",
        MR_GREY,
        statistics=statistics,
        level=SurfaceLevel(90.0, None, 1.0),
        confidence=1.0,
        why_unclear="",
        modality="MR",
    )
    repair = RepairOptions(0, 0, 0, 0, 0, 0)
    survey = ChannelSurvey(statistics, "", {}, repair, look, (), None)
    assert survey.is_body is is_body
    colored = color_vessels(survey, modality="MR").appearance.color
    assert colored == (MR_GREY if is_body else VESSEL_RED)
    assert color_vessels(survey, modality="CT") == survey
    stated = replace(survey, appearance=replace(look, color=(0.0, 0.0, 1.0)))
    assert color_vessels(stated, modality="MR") == stated
