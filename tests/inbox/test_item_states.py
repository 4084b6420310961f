"""The states of an item that the queue file may hold are those that the program knows."""

import json
from pathlib import Path

from stereocell.inbox.item import DOINGS

SCHEMA = Path(__file__).parents[2] / "schemas" / "inbox.schema.json"


def test_the_schema_has_the_states_of_the_program() -> None:
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    assert schema["$defs"]["Item"]["properties"]["doing"]["enum"] == list(DOINGS)
