"""The colours of channels: stated, of a dye, a wavelength or a modality, and all different."""

from itertools import combinations

import numpy as np
import pytest
from skimage.color import deltaE_ciede2000, rgb2hsv, rgb2lab

from stereocell.model.color import lab_of_linear, linear_color_of_lab, to_srgb8
from stereocell.model.emission_color import color_of_light, color_of_name, emission_of
from stereocell.planning.channel_colors import (
    AMBER,
    STAIN,
    WARM_GREY,
    choose_colors,
    is_lone,
    lies_at_bone,
    shows_stain,
)
from stereocell.planning.channels import FLESH, MR_GREY, PALETTE, SKIN
from stereocell.planning.settings import load

Color = tuple[float, float, float]


def _hue_deg(color: Color) -> float:
    return 360 * float(rgb2hsv(to_srgb8(np.array([color], np.float32)))[0, 0])


@pytest.mark.parametrize(
    ("name", "nm"),
    [
        ("DAPI", 461),
        ("Hoechst 33342", 461),
        ("nuclei_Hoechst", 461),
        ("EGFP", 510),
        ("Alexa Fluor 488", 519),
        ("CD3 (AF488)", 519),
        ("AlexaFluor647", 667),
        ("FITC", 520),
        ("Cy3", 570),
        ("Cy 3.5", 610),
        ("Cy5", 667),
        ("Cy5.5", 700),
        ("mCherry-H2B", 610),
        ("tdTomato", 583),
        ("TRITC", 570),
    ],
)
def test_a_dye_is_found_in_a_channel_name(name: str, nm: float) -> None:
    assert emission_of(name) == nm


# Emission maxima in nm that the makers publish. The colour is that of the emitted light.
@pytest.mark.parametrize(
    ("name", "nm"),
    [
        *[("CF405S", 431), ("CF488A", 515), ("CF568", 583), ("Anti-CD4 CF640R", 662)],
        *[("DyLight 350", 432), ("DyLight 488", 518), ("DyLight-594", 618), ("DyLight650", 672)],
        *[("BODIPY FL", 513), ("BODIPY 493/503", 503), ("BODIPY 581/591", 591)],
        *[("JF549", 571), ("Janelia Fluor 646", 664), ("JFX650", 667)],
        *[("Qdot 655", 655), ("QDOT525", 525), ("BV421", 421), ("CD8_BV605", 605)],
        *[("Brilliant Violet 510", 510), ("BUV737", 737), ("eFluor 450", 450)],
        *[("ATTO 488", 523), ("Atto594", 624), ("ATTO647N", 669), ("STAR 635P", 651)],
        *[("SYTOX Green", 523), ("SYTOX Orange", 576), ("MitoTracker Deep Red FM", 665)],
        *[("MitoTracker Red CMXRos", 603), ("LysoTracker Blue", 460), ("Opal 690", 694)],
    ],
)
def test_a_dye_of_a_numbered_family_has_the_colour_of_its_light(name: str, nm: float) -> None:
    found = color_of_name(name)
    assert found is not None
    hue_deg = abs(_hue_deg(found) - _hue_deg(color_of_light(nm) or (0, 0, 0)))
    assert min(hue_deg, 360 - hue_deg) <= 45  # the same band of the spectrum, or a neighbouring one


@pytest.mark.parametrize("name", ["BV2 cells", "CF", "JF", "CF 12", "BV4210", "scf488", "starch"])
def test_a_name_that_resembles_a_family_of_dyes_names_no_dye(name: str) -> None:
    assert emission_of(name) is None


@pytest.mark.parametrize(
    "name", ["", "Channel0", "CD31", "MART1", "Ki67", "afferent", "cyclin", "A4"]
)
def test_other_names_name_no_dye(name: str) -> None:
    assert emission_of(name) is None
    assert color_of_name(name) is None


@pytest.mark.parametrize(
    ("nm", "low_deg", "high_deg"),
    [
        *[(420, 240, 275), (461, 215, 245), (495, 170, 200), (519, 100, 140)],
        *[(560, 45, 60), (590, 20, 40), (620, 0, 10), (670, 305, 335)],
    ],
)
def test_a_wavelength_has_the_colour_that_people_see(
    nm: float, low_deg: float, high_deg: float
) -> None:
    color = color_of_light(nm)
    assert color is not None
    assert low_deg <= _hue_deg(color) <= high_deg
    assert min(color) > 0.01  # not a pure primary, which a screen can't shade


def test_a_dye_gives_the_colour_if_no_wavelength_is_stated() -> None:
    assert color_of_light(None) is None
    assert color_of_light("0") is None
    assert color_of_light("of the laser", "GFP") == color_of_light(510)


def test_converting_a_colour_to_lab_and_back_returns_it() -> None:
    color = linear_color_of_lab((62.0, 20.0, -31.0))
    np.testing.assert_allclose(lab_of_linear(np.array([color]))[0], (62, 20, -31), atol=1e-3)


def _chosen(
    names: list[str],
    stated: list[Color | None] | None = None,
    modality: str = "",
    alone: bool = False,
    bone: bool = False,
) -> list[Color]:
    wanted = list(zip(names, stated or [None] * len(names), strict=True))
    return choose_colors(wanted, modality=modality, is_alone=alone, is_bone=bone)


def test_channels_that_name_no_dye_have_the_colours_of_the_palette() -> None:
    assert _chosen(["a", "b", "c"]) == list(PALETTE[:3])


def test_scans_of_patients_are_not_blue_like_nuclei() -> None:
    assert _chosen(["MR"], modality="MR") == [MR_GREY]
    assert _chosen(["CT"], modality="CT") == [SKIN]
    assert _chosen(["CT"], modality="CT", bone=True) == [FLESH]
    assert _chosen(["PT"], modality="PT") == [AMBER]
    assert _chosen(["Channel0"], alone=True) == [WARM_GREY]
    assert _chosen(["DAPI"], alone=True) == [color_of_light(461)]


@pytest.mark.parametrize(
    ("spacing_um", "is_dark", "is_stained"),
    [
        ((0.5, 0.2, 0.2), False, True),
        ((5.0, 2.0, 2.0), False, True),
        ((25.0, 25.0, 25.0), False, False),  # a mouse brain, which shows its own light
        ((0.03, 0.004, 0.004), True, False),  # electron microscopy
    ],
)
def test_the_only_channel_of_stained_cells_has_the_colour_of_a_stain(
    spacing_um: tuple[float, float, float], is_dark: bool, is_stained: bool
) -> None:
    assert shows_stain(spacing_um, is_dark=is_dark) == is_stained
    wanted = [("Channel0", None)]
    (color,) = choose_colors(wanted, modality="", is_alone=True, is_stained=is_stained)
    assert color == (STAIN if is_stained else WARM_GREY)
    light, least = max(color), min(color)
    assert ((light - least) / light > 0.5) == is_stained  # a clearly visible hue
    # a modality, a dye's name and a stated colour take precedence
    assert choose_colors(wanted, modality="MR", is_alone=True, is_stained=True) == [MR_GREY]
    named = choose_colors([("DAPI", None)], modality="", is_alone=True, is_stained=True)
    assert named == [color_of_light(461)]
    stated = choose_colors([("a", PALETTE[2])], modality="", is_alone=True, is_stained=True)
    assert stated == [PALETTE[2]]


@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (["signal", "background"], [STAIN, PALETTE[1]]),
        (["AF", "signal"], [PALETTE[0], STAIN]),
        (["background"], [STAIN]),
        (["a", "b"], list(PALETTE[:2])),
        (["a", "b", "autofluorescence"], list(PALETTE[:3])),
    ],
)
def test_a_single_stain_beside_autofluorescence_has_the_colour_of_a_stain(
    names: list[str], expected: list[Color]
) -> None:
    wanted = [(name, None) for name in names]
    assert expected == choose_colors(wanted, modality="", is_alone=is_lone(names), is_stained=True)


@pytest.mark.parametrize(("preset", "is_bone"), [("ct", False), ("ct-bone", True)])
def test_a_preset_for_bone_is_distinguished_from_one_for_skin(preset: str, is_bone: bool) -> None:
    iso_values = load(preset, None, flags={}).iso_values
    assert lies_at_bone(iso_values, is_hounsfield=True) == is_bone
    assert not lies_at_bone(iso_values, is_hounsfield=False)


@pytest.mark.parametrize(
    "names",
    [
        ["GFP", "Alexa 488", "FITC"],
        ["DAPI", "Hoechst", "CD31"],
        ["Cy5", "AF647", "AF680", "Cy7"],
        ["DAPI", "GFP", "Cy3", "Cy5"],
        ["mCherry", "tdTomato", "Cy3", "PALETTE"],
    ],
)
def test_channels_of_similar_dyes_have_different_colours(names: list[str]) -> None:
    colors = _chosen(names)
    assert colors[0] == color_of_name(names[0])
    lab = rgb2lab(to_srgb8(np.array(colors, np.float32)))
    pairs = combinations(range(len(colors)), 2)
    assert min(float(deltaE_ciede2000(lab[a], lab[b])) for a, b in pairs) > 8


def test_a_stated_colour_is_kept_unless_an_earlier_channel_has_it() -> None:
    green: Color = (0.0, 1.0, 0.0)
    first, second = _chosen(["a", "b"], [green, (0.02, 0.98, 0.02)])
    assert first == green
    assert second == PALETTE[1]
    assert _chosen(["a"], [green], modality="MR") == [green]


def test_a_stated_black_is_replaced_by_a_visible_colour() -> None:
    assert _chosen(["a", "GFP"], [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0)]) == [
        PALETTE[0], color_of_name("GFP"),
    ]  # fmt: skip


def test_a_dye_keeps_its_colour_after_channels_that_name_no_dye() -> None:
    names = ["CD31", "DAPI", "CD45", "AF488", "CD3"]
    colors = _chosen(names)
    assert [colors[1], colors[3]] == [color_of_light(461), color_of_light(519)]
    assert len(set(colors)) == len(names)


def test_a_stated_colour_of_a_later_channel_takes_precedence_over_a_dye() -> None:
    green = color_of_light(519)
    colors = _chosen(["GFP", "CD31"], [None, green])
    assert colors[1] == green
    assert colors[0] != green


def test_all_channels_have_colours_even_if_the_palette_has_fewer() -> None:
    assert _chosen(list("abcdefghij")) == [*PALETTE, *PALETTE[:2]]
