"""Read and write survey.json; schemas/units.schema.json describes it."""

from stereocell.building.out_folder import SURVEY, OutFolder
from stereocell.planning.survey import Survey, surveys
from stereocell.storage.json_files import find_sealed


def read_survey(out_folder: OutFolder) -> Survey:
    """Return the survey in survey.json. Raises OutputError if it is missing or damaged."""
    return surveys().validate_python(out_folder.survey())


def save_survey(out_folder: OutFolder, survey: Survey) -> None:
    """Write survey.json, except where the file holds the same survey already.

    A file of an earlier version may have other names for the same content. It stays, because the
    stage was made of that file.
    """
    adapter = surveys()
    content = adapter.dump_python(survey, mode="json")
    found = find_sealed(out_folder.survey_file, SURVEY)
    if found is not None:
        there = adapter.validate_python(found["channels"])
        if adapter.dump_python(there, mode="json") == content:
            return
    out_folder.save_survey(content)
