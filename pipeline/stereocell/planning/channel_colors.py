"""Choose the colours of a build's channels: the file's own, then recognised ones, then PALETTE's.

- The body in an MR or a CT is warm: a CT has the colour of skin or of bone.
- Radiotracers are amber.
- A channel that is named after a dye has the colour of the dye's light.
- The only channel of a volume is cyan if it shows stained cells, and warm grey otherwise.
- All other channels take the colours of PALETTE in order.

No two channels have nearly the same colour: the later one takes the next colour of PALETTE.
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
# Linear RGB of the only channel of stained cells. Cyan was chosen by eye on a Golgi apparatus and
# an ovule. It shows more shading on a dark ground than green, and looks less like a material than
# orange.
STAIN = color_of_light(490.0)
# um: largest value of the finest voxel spacing at which a microscope's volume is taken for stained
# cells. Wider voxels belong to organs, such as a mouse brain, which mostly show their own light.
_STAINED_UM = 10.0
_BLACK = 0.01  # linear RGB, 0..1; a colour without a larger component is invisible on dark ground
NEAR = 12.0  # CIELab distance; two lit colours nearer than this are hard to distinguish


def choose_colors(
    channels: Sequence[tuple[str, Color | None]],
    *,
    modality: str,
    is_alone: bool,
    is_bone: bool = False,
    is_stained: bool = False,
) -> list[Color]:
    """Return the colour of each channel that is built, in linear RGB, 0..1.

    channels    name of each channel, and the colour that the file states for it
    modality    DICOM's code; empty: not known
    is_alone    whether the source has a single channel besides autofluorescence
    is_bone     whether the surface of a CT lies at its bones
    is_stained  whether the voxels show stained cells; see `shows_stain`
    """
    places = range(len(channels))
    modal = [_of_modality(place, modality, is_bone=is_bone) for place in places]
    color = (STAIN if is_stained else WARM_GREY) if is_alone and not modality else None
    lone = [None if shows_own_light(name) and len(channels) > 1 else color for name, _ in channels]
    chosen: dict[int, Color] = {}
    # Each round gives colours to all channels before the next round starts. So DAPI is blue, even
    # if a channel of PALETTE comes first.
    for candidates in (
        [[stated] for _, stated in channels],
        [[modal[place], color_of_name(channels[place][0]), lone[place]] for place in places],
        [PALETTE[place % len(PALETTE) :] + PALETTE[: place % len(PALETTE)] for place in places],
    ):
        for place in places:
            if place not in chosen:
                free = _first_free(candidates[place], list(chosen.values()))
                chosen.update({} if free is None else {place: free})
    # If there are more channels than colours in PALETTE, its colours are repeated.
    return [chosen.get(place, PALETTE[place % len(PALETTE)]) for place in places]


def is_lone(names: Sequence[str]) -> bool:
    """Return whether only one of the named channels is not autofluorescence."""
    return len(names) == 1 or sum(not shows_own_light(name) for name in names) == 1


def shows_stain(spacing_um: Sequence[float], *, is_dark: bool) -> bool:
    """Return whether a microscope's voxels show stained cells.

    spacing_um  voxel spacing along each axis, um
    is_dark     whether structures are darker than their surroundings, as in electron microscopy
    """
    return not is_dark and min(spacing_um) <= _STAINED_UM


def lies_at_bone(iso_values: Mapping[str, float | str], *, is_hounsfield: bool) -> bool:
    """Return whether the settings put a CT's surface at its bones, as preset `ct-bone` does."""
    level = iso_values.get(ALL)
    if level is None or not is_hounsfield:
        return False
    return parse_level("iso-value", level)[0] >= BONE_LEVEL_HU


def _first_free(candidates: Sequence[Color | None], taken: Sequence[Color]) -> Color | None:
    """Return the first colour that is visible and differs enough from all taken colours."""
    visible = (color for color in candidates if color is not None and max(color) > _BLACK)
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
