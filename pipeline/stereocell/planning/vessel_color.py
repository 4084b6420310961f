"""The colour of vessels in an MR: red, where a body has the greys of its slices.

An angiogram is not told from other images of MR by its header in NIfTI, and by its level alone it
is: vessels fill little of the volume (see `ChannelSurvey.is_body`). So the colour is known after
the first pass, and not when the plan is made.
"""

from dataclasses import replace

from stereocell.planning.channels import MR_GREY
from stereocell.planning.survey import ChannelSurvey

VESSEL_RED = (0.74, 0.12, 0.08)  # linear RGB, of blood


def color_vessels(survey: ChannelSurvey, *, modality: str) -> ChannelSurvey:
    """Return the survey of a channel, whose colour is red if it shows the vessels of an MR.

    modality  DICOM's code, of what took the volume

    A colour that the file states stays.
    """
    look = survey.appearance
    if modality != "MR" or look.color != MR_GREY or survey.is_body:
        return survey
    return replace(survey, appearance=replace(look, color=VESSEL_RED))
