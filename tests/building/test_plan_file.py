"""plan.json: what the dataclasses say and what the schema says are the same."""

import json
from dataclasses import fields

from stereocell.building.channels import Channel
from stereocell.building.plan import Plan
from stereocell.storage.assets import schema_path


def test_the_schema_has_the_plan_s_fields() -> None:
    schema = json.loads(schema_path("plan.schema.json").read_bytes())
    own = ["format", "version", *(field.name for field in fields(Plan))]
    assert list(schema["properties"]) == schema["required"] == own
    channel = schema["properties"]["channels"]["items"]
    assert list(channel["properties"]) == [field.name for field in fields(Channel)]
