"""Names of settings, values and keys of plans in earlier versions are still read."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from stereocell.api import build
from stereocell.building.made_of import find_stale
from stereocell.building.out_folder import OutFolder
from stereocell.building.survey_file import read_survey
from stereocell.cli.__main__ import main
from stereocell.engine.step import key_of
from stereocell.model.errors import UsageError
from stereocell.planning.plan_file import from_json, to_json
from stereocell.planning.settings import load, to_toml
from stereocell.storage.assets import schema_path
from support import phantoms
from support.plans import plan_of
from support.sealed_files import edit_sealed, seal

KEY, CRITERION = "rung", "ladder"  # earlier names of `level` and of the criterion `levels`


def _file(folder: Path, content: str) -> Path:
    file = folder / "settings.toml"
    file.write_text(f"[isovalue]\n{content}\n")
    return file


def _to_earlier(settings: dict[str, dict[str, object]]) -> None:
    """Rename keys and values of settings as an earlier version wrote them."""
    isovalue = settings["isovalue"]
    isovalue[KEY] = isovalue.pop("level")
    assert isovalue["criterion"] == "levels"
    isovalue["criterion"] = CRITERION


@pytest.fixture
def source(tmp_path: Path) -> Path:
    return phantoms.write_ome_tiff(tmp_path / "f.ome.tif", phantoms.f_phantom(), names=["F"])


@pytest.mark.parametrize("is_preset", [False, True])
def test_an_earlier_name_in_a_file_is_read_and_one_line_has_the_present_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], is_preset: bool
) -> None:
    file = _file(tmp_path, f'{KEY} = "inner"')
    settings = load(str(file), None, flags={}) if is_preset else load(None, file, flags={})
    assert settings.isovalue.level == "inner"
    where = f"preset {file}" if is_preset else str(file)
    printed = capsys.readouterr().err
    assert printed == f"{where}: isovalue.{KEY} is now called isovalue.level\n"
    assert KEY not in to_toml(settings)


def test_an_earlier_value_in_a_file_is_read_and_one_line_has_the_present_value(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = _file(tmp_path, f'criterion = "{CRITERION}"')
    assert load(None, file, flags={}).isovalue.criterion == "levels"
    printed = capsys.readouterr().err
    assert printed == f"{file}: isovalue.criterion: {CRITERION!r} is now called 'levels'\n"


def test_present_names_print_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    load(None, _file(tmp_path, 'level = "inner"\ncriterion = "levels"'), flags={})
    assert capsys.readouterr().err == ""


def test_an_earlier_and_the_present_name_together_are_refused_in_one_line(tmp_path: Path) -> None:
    file = _file(tmp_path, f'{KEY} = "inner"\nlevel = "outer"')
    with pytest.raises(UsageError) as raised:
        load(None, file, flags={})
    assert str(raised.value) == (
        f"{file}: found isovalue.{KEY} and isovalue.level, which are one setting, expected only "
        "isovalue.level"
    )


def test_a_wrong_value_under_an_earlier_name_is_reported_by_the_present_name(
    tmp_path: Path,
) -> None:
    with pytest.raises(UsageError, match=r"isovalue\.level is 3, expected text"):
        load(None, _file(tmp_path, f"{KEY} = 3"), flags={})


def test_an_earlier_value_of_a_flag_is_read_and_the_line_names_the_flag(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out), "--iso-criterion", CRITERION]) == 0
    assert OutFolder(out).plan().settings.isovalue.criterion == "levels"
    printed = capsys.readouterr().err
    assert printed.count("is now called") == 1
    assert f"--iso-criterion: {CRITERION!r} is now called 'levels'\n" in printed


def test_an_earlier_name_in_python_is_read_and_printed_once(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    build(source, tmp_path / "out", settings={"isovalue": {KEY: "none"}}, workers=0)
    assert OutFolder(tmp_path / "out").plan().settings.isovalue.level == "none"
    printed = capsys.readouterr().err
    assert printed.count("is now called") == 1
    assert f"settings: isovalue.{KEY} is now called isovalue.level\n" in printed


def test_a_plan_of_an_earlier_version_is_read(capsys: pytest.CaptureFixture[str]) -> None:
    plan = plan_of()
    plan = replace(plan, channels=(replace(plan.channels[0], level="inner"), *plan.channels[1:]))
    content = to_json(plan)
    _to_earlier(content["settings"])
    channel = content["channels"][0]
    channel[KEY] = channel.pop("level")
    schema = json.loads(schema_path("plan.schema.json").read_bytes())
    jsonschema.validate(seal(content), schema)
    assert from_json(content) == plan
    assert capsys.readouterr().err == ""
    channel["level"] = "outer"
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(seal(content), schema)


def test_units_of_an_earlier_version_stay_valid(source: Path, tmp_path: Path) -> None:
    """Its plan, survey and key of the plan have the earlier names."""
    out = tmp_path / "out"
    assert main(["plan", str(source), "-o", str(out), "--surfaces", "F=outer"]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    folder = OutFolder(out)
    plan, survey = folder.plan(), read_survey(folder)

    def to_earlier_plan(content: dict[str, Any]) -> None:
        _to_earlier(content["settings"])
        channel = content["channels"][0]
        channel[KEY] = channel.pop("level")

    def to_earlier_survey(content: dict[str, Any]) -> None:
        for channel in content["channels"].values():
            channel["ladder"] = channel.pop("levels")

    edit_sealed(folder.plan_file, to_earlier_plan)
    edit_sealed(folder.survey_file, to_earlier_survey)
    content = json.loads(folder.plan_file.read_bytes())
    del content["sha256"]
    key = key_of({**content, "notes": []})
    edit_sealed(folder.units_plan_file, lambda signed: signed.update(key=key))
    assert folder.plan() == plan
    assert read_survey(folder) == survey
    folder.require_units_of(plan)
    assert main(["stage", str(out), "--workers", "0"]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    assert find_stale(folder) is None  # the stage is still made of these units
