"""plan.json: the dataclasses and the schema have the same fields."""

import json
from dataclasses import fields, replace

import jsonschema

from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan
from stereocell.planning.plan_file import from_json, to_json
from stereocell.planning.provenance import provenance
from stereocell.storage.assets import schema_path
from support.plans import plan_of
from support.sealed_files import seal

# Fields that plans of an earlier version lack
_LATER = ("formats", "notes", "is_hounsfield")
_EARLIER = ("rung",)  # keys of a channel that only plans of an earlier version have


def test_the_schema_has_the_plan_s_fields() -> None:
    schema = json.loads(schema_path("plan.schema.json").read_bytes())
    own = ["format", "version", *(field.name for field in fields(Plan)), "sha256"]
    assert list(schema["properties"]) == own
    assert schema["required"] == [name for name in own if name not in _LATER]
    channel = schema["properties"]["channels"]["items"]
    present = [name for name in channel["properties"] if name not in _EARLIER]
    assert present == [field.name for field in fields(Channel)]


def test_a_plan_of_an_earlier_version_without_formats_is_read() -> None:
    content = to_json(plan_of())
    del content["formats"]
    jsonschema.validate(seal(content), json.loads(schema_path("plan.schema.json").read_bytes()))
    assert from_json(content) == replace(plan_of(), formats=())


def test_a_plan_without_notes_on_its_source_is_read() -> None:
    content = to_json(replace(plan_of(), notes=("one note",)))
    assert from_json(content).notes == ("one note",)
    del content["notes"]
    jsonschema.validate(seal(content), json.loads(schema_path("plan.schema.json").read_bytes()))
    assert from_json(content) == plan_of()


def test_results_name_the_libraries_of_their_own_reader_only() -> None:
    def named(*formats: str) -> set[str]:
        return set(provenance(replace(plan_of(), formats=formats))["libraries"])

    assert {"numpy", "usd-core", "zarr"} <= named("ome-zarr")
    others = {"nibabel", "pydicom", "tifffile", "mrcfile", "pynrrd", "liffile", "nd2", "bioio"}
    assert not others & named("ome-zarr")
    assert {"nibabel", "pydicom"} & named("ome-zarr", "nifti") == {"nibabel"}
