"""A schema may refer to another one by its `$id`, so that two documents share one definition."""

import json
from pathlib import Path
from typing import Any

import pytest

from stereocell.model.errors import OutputError
from stereocell.storage.documents import parse

SHAPE = {
    "kind": "rectangle",
    "values": [0.1, 0.4],
    "gradients": [0.2, 0.6],
    "tip": 0.3,
    "color": [1, 1, 1],
    "opacity": 0.5,
    "softness": 0.5,
}


def _parse(**changed: Any) -> Any:
    functions = {"gradient_max": 0.5, "functions": {"arcs": [SHAPE]}, **changed}
    text = json.dumps(functions).encode()
    return parse(Path("survey.json"), text, "units.schema.json#TransferFunctions2d", "again")


def test_functions_of_a_survey_fit_the_definition_of_the_bundle() -> None:
    assert _parse()["gradient_max"] == 0.5
    assert _parse(another_number=2.0)["another_number"] == 2.0


@pytest.mark.parametrize(
    ("changed", "fault"),
    [
        ({"gradient_max": 0}, r"\$\.gradient_max: 0 is less than or equal to the minimum of 0"),
        ({"functions": {"arcs": [SHAPE | {"tip": 3}]}}, r"arcs\[0\]\.tip: 3 is greater than"),
        ({"functions": {"arcs": [SHAPE | {"values": [0.1]}]}}, r"arcs\[0\]\.values: "),
        ({"another": "text"}, r"\$\.another: 'text' is not of type 'number'"),
    ],
)
def test_values_outside_of_the_shared_definition_are_refused(
    changed: dict[str, Any], fault: str
) -> None:
    with pytest.raises(OutputError, match=fault):
        _parse(**changed)
