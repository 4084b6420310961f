"""Read and write survey.json; schemas/units.schema.json describes it."""

from stereocell.building.out_folder import OutFolder
from stereocell.planning.survey import Survey, surveys


def read_survey(out_folder: OutFolder) -> Survey:
    """Return the survey in survey.json. Raises OutputError if it is missing or damaged."""
    return surveys().validate_python(out_folder.survey())


def save_survey(out_folder: OutFolder, survey: Survey) -> None:
    """Write survey.json."""
    out_folder.save_survey(surveys().dump_python(survey, mode="json"))
