"""Colour the vessels of an MR angiogram red; other MR images keep the grey of their slices.

The header of a NIfTI file does not state an angiogram. Its level shows one, because vessels fill
little of the volume (see `ChannelSurvey.is_body`). So the colour is known only after the survey,
and not when the plan is made.
"""

from dataclasses import replace

from stereocell.planning.channels import MR_GREY
from stereocell.planning.survey import ChannelSurvey

VESSEL_RED = (0.74, 0.12, 0.08)  # linear RGB, of blood


def color_vessels(survey: ChannelSurvey, *, modality: str) -> ChannelSurvey:
    """Return the survey of a channel, in red if it shows the vessels of an MR.

    modality  DICOM's code of the volume's modality

    A colour that the file states is kept.
    """
    appearance = survey.appearance
    if modality != "MR" or appearance.color != MR_GREY or survey.is_body:
        return survey
    return replace(survey, appearance=replace(appearance, color=VESSEL_RED))
