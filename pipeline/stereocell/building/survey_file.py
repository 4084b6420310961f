"""survey.json, which schemas/units.schema.json describes for other readers."""

from stereocell.building.out_folder import OutFolder
from stereocell.planning.survey import Survey, surveys


def read_survey(out_folder: OutFolder) -> Survey:
    """Return the content of survey.json. Raises OutputError where it is missing or damaged."""
    return surveys().validate_python(out_folder.survey())


def save_survey(out_folder: OutFolder, survey: Survey) -> None:
    """Write survey.json."""
    out_folder.save_survey(surveys().dump_python(survey, mode="json"))
