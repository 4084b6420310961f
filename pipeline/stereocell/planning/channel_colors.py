"""The colours of a build's channels: as the file states them, else by what is recognised.

Scans of bodies are warm, a CT as skin or as bone, radiotracers amber, a channel that is named after
a dye has the colour of its light. The only channel of a volume is cyan where its voxels are those
of stained cells, and a warm grey otherwise. All others have PALETTE's colours. Stated colours
are given to all channels first, then recognised ones, then PALETTE's. No two channels have nearly
the same colour: the later one takes the next of PALETTE.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from stereocell.isosurface.options import parse_level
from stereocell.model.color import lab_of_linear
from stereocell.model.emission_color import color_of_light, color_of_name
from stereocell.model.modality import TRACER_MODALITIES
from stereocell.planning.channels import (
    ALL,
    BODY_MODALITIES,
    FLESH,
    MR_GREY,
    PALETTE,
    SKIN,
    shows_own_light,
)
from stereocell.transfer.ct_tissues import BONE_LEVEL_HU

Color = tuple[float, float, float]
AMBER = (1.0, 0.6, 0.24)  # linear RGB of tracers of PET and SPECT: the lightest part of a heat map
WARM_GREY = (0.62, 0.58, 0.52)  # linear RGB of the only channel of a volume that shows no stain
# Linear RGB of the only channel of stained cells. Cyan was chosen by eye, on a Golgi apparatus and
# an ovule: it shows more shading on a dark ground than green does, and looks less like a material
# than orange does.
STAIN = color_of_light(490.0)
# um: finest voxel spacing up to which a volume of a microscope is taken for stained cells. Wider
# voxels are those of organs, as a brain of a mouse, which are mostly seen by their own light.
_STAINED_UM = 10.0
_BLACK = 0.01  # linear RGB; a colour with no lighter part can't be seen on a dark ground
NEAR = 12.0  # distance in CIELab below which two colours are hard to tell apart when lit


def choose_colors(
    channels: Sequence[tuple[str, Color | None]],
    *,
    modality: str,
    is_alone: bool,
    is_bone: bool = False,
    is_stained: bool = False,
) -> list[Color]:
    """Return the colour, linear RGB, of each channel that is built.

    channels  each one's name, and the colour that the file states
    modality  DICOM's code; empty: not known
    is_alone  whether the source has one channel only, beside those of autofluorescence
    is_bone   whether the surface of a CT lies at its bones
    is_stained  whether the voxels are those of stained cells; see `shows_stain`
    """
    places = range(len(channels))
    modal = [_of_modality(place, modality, is_bone=is_bone) for place in places]
    color = (STAIN if is_stained else WARM_GREY) if is_alone and not modality else None
    lone = [None if shows_own_light(name) and len(channels) > 1 else color for name, _ in channels]
    chosen: dict[int, Color] = {}
    # No later round takes a colour of an earlier one: DAPI is blue behind a channel "CD31" too.
    for wishes in (
        [[stated] for _, stated in channels],
        [[modal[place], color_of_name(channels[place][0]), lone[place]] for place in places],
        [PALETTE[place % len(PALETTE) :] + PALETTE[: place % len(PALETTE)] for place in places],
    ):
        for place in places:
            if place not in chosen:
                free = _first_free(wishes[place], list(chosen.values()))
                chosen.update({} if free is None else {place: free})
    # More channels than the palette has colours: the others repeat it.
    return [chosen.get(place, PALETTE[place % len(PALETTE)]) for place in places]


def is_lone(names: Sequence[str]) -> bool:
    """Return whether channels of these names are one, beside those of autofluorescence."""
    return len(names) == 1 or sum(not shows_own_light(name) for name in names) == 1


def shows_stain(spacing_um: Sequence[float], *, is_dark: bool) -> bool:
    """Return whether voxels are those of stained cells, if they are a microscope's.

    spacing_um  voxel spacing along each axis
    is_dark     whether structures are darker than their surroundings, as in electron microscopy
    """
    return not is_dark and min(spacing_um) <= _STAINED_UM


def lies_at_bone(iso_values: Mapping[str, float | str], *, is_hounsfield: bool) -> bool:
    """Return whether the settings put a CT's surface at its bones, as preset `ct-bone` does."""
    level = iso_values.get(ALL)
    if level is None or not is_hounsfield:
        return False
    return parse_level("iso-value", level)[0] >= BONE_LEVEL_HU


def _first_free(wishes: Sequence[Color | None], taken: Sequence[Color]) -> Color | None:
    """Return the first colour that can be seen and is not near one that is taken."""
    visible = (color for color in wishes if color is not None and max(color) > _BLACK)
    return next((color for color in visible if not _is_near(color, taken)), None)


def _of_modality(place: int, modality: str, *, is_bone: bool) -> Color | None:
    if place == 0 and modality in BODY_MODALITIES:
        if modality == "MR":
            return MR_GREY
        return FLESH if is_bone else SKIN
    return AMBER if place == 0 and modality in TRACER_MODALITIES else None


def _is_near(color: Color, others: Sequence[Color]) -> bool:
    if not others:
        return False
    lab = lab_of_linear(np.array([color, *others]))
    return bool((np.linalg.norm(lab[1:] - lab[0], axis=1) < NEAR).any())
