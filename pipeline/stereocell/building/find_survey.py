"""Find the survey of a build: what all tiles of a channel share, before the units are built."""

from stereocell.building.passes import Passes
from stereocell.building.phase import Phase
from stereocell.building.survey_file import save_survey
from stereocell.planning.channel_survey import (
    choose_level_of,
    notes_on_holders,
    notes_on_survey,
    survey_channel,
)
from stereocell.planning.covering_channels import leave_out_covering
from stereocell.planning.level_choice import find_level
from stereocell.planning.survey import Survey


def find_survey(passes: Passes, phase: Phase) -> Survey:
    """Find the window, level, repair and appearance of each channel, the same for all tiles."""
    plan = passes.plan
    found_windows = passes.windows()
    windows, files = dict(found_windows), found_windows.files()
    phase.print(*notes_on_holders(plan, windows))
    evidence = passes.evidence(windows)
    found = {
        one.id: find_level(plan, one, windows[one.id], evidence[one.id]) for one in plan.channels
    }
    components = passes.components(found)
    chosen = {
        id_: choose_level_of(plan, one, evidence[id_], [level[id_] for level in components])
        for id_, one in found.items()
    }
    chosen = leave_out_covering(plan, chosen)
    survey = {
        one.id: survey_channel(plan, one, chosen[one.id], files[one.id]) for one in plan.channels
    }
    save_survey(passes.out_folder, survey)
    phase.print(*notes_on_survey(plan, survey, chosen))
    return survey
