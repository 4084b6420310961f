"""The colours of a build's channels: as the file states them, else by what is recognised.

Scans of bodies are warm and pale, radiotracers amber, a channel that is named after a dye has the
colour of its light, and a volume of one channel is a warm grey. All others have PALETTE's colours.
No two channels have nearly the same one: the later takes the next of PALETTE.
"""

from collections.abc import Sequence

import numpy as np

from stereocell.building.channels import BODY_MODALITIES, FLESH, PALETTE
from stereocell.model.color import lab_of_linear
from stereocell.model.emission_color import color_of_name
from stereocell.model.modality import TRACER_MODALITIES

Color = tuple[float, float, float]
AMBER = (1.0, 0.6, 0.24)  # linear RGB of tracers of PET and SPECT: the lightest part of a heat map
WARM_GREY = (0.62, 0.58, 0.52)  # linear RGB of the only channel of a volume
_BLACK = 0.01  # linear RGB; a colour with no lighter part can't be seen on a dark ground
NEAR = 12.0  # distance in CIELab below which two colours are hard to tell apart when lit


def choose_colors(
    channels: Sequence[tuple[str, Color | None]], *, modality: str, is_alone: bool
) -> list[Color]:
    """Return the colour, linear RGB, of each channel that is built.

    channels  each one's name, and the colour that the file states
    modality  DICOM's code; empty: not known
    is_alone  whether the source has one channel only
    """
    chosen: list[Color] = []
    for place, (name, stated) in enumerate(channels):
        wanted = [stated, _of_modality(place, modality), color_of_name(name)]
        wanted += [WARM_GREY if is_alone and not modality else None]
        wanted += [PALETTE[(place + step) % len(PALETTE)] for step in range(len(PALETTE))]
        colors = [color for color in wanted if color is not None and max(color) > _BLACK]
        chosen.append(next((one for one in colors if not _is_near(one, chosen)), colors[0]))
    return chosen


def _of_modality(place: int, modality: str) -> Color | None:
    if place == 0 and modality in BODY_MODALITIES:
        return FLESH
    return AMBER if place == 0 and modality in TRACER_MODALITIES else None


def _is_near(color: Color, others: Sequence[Color]) -> bool:
    if not others:
        return False
    lab = lab_of_linear(np.array([color, *others]))
    return bool((np.linalg.norm(lab[1:] - lab[0], axis=1) < NEAR).any())
