"""Each record of a build has a hash; the same code checks records when writing and reading."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from stereocell.building.out_folder import OutFolder
from stereocell.cli.__main__ import main
from stereocell.model.errors import OutputError
from stereocell.storage.atomic_write import write_bytes
from stereocell.storage.documents import SCHEMAS, SETTINGS, schema_of
from stereocell.storage.json_files import write_json
from stereocell.verify.formats import check
from support import phantoms
from support.error_lines import error_line
from support.sealed_files import edit_sealed

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("without_node")]

RECORDS = ("plan.json", "provenance.json", SETTINGS, "phases.json", "report/index.html")
OF_UNITS = ("units/plan.key", "units/done.json", "units/survey.json")
# Commands that read OUT, and would build from it
COMMANDS = (
    ["units"],
    ["units", "--only", "r0_c0/F"],
    ["stage"],
    ["bundle"],
    ["report"],
    ["tissue"],
)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sealed")
    source = phantoms.write_ome_tiff(
        folder / "f.ome.tif", phantoms.f_phantom()[None], "CZYX", names=["F"]
    )
    build = ["build", str(source), "-o", str(folder / "out"), "--workers", "0", "--grid", "1x1"]
    assert main(build) == 0
    return folder / "out"


@pytest.fixture
def out(built: Path, tmp_path: Path) -> Path:
    return shutil.copytree(built, tmp_path / "out")


def _faults(out: Path) -> str:
    return "\n".join(line.detail for line in check(out) if not line.ok)


def _change(file: Path) -> None:
    """Change the last digit or letter before a file's last 160 bytes."""
    data = bytearray(file.read_bytes())
    for place in range(max(len(data) - 160, len(data) // 2), 0, -1):
        if not data[place : place + 1].isalnum():
            continue
        changed = bytearray(data)
        changed[place] = ord("1") if data[place] != ord("1") else ord("2")
        if file.suffix != ".json" or _is_json(changed):  # `true` with a digit in it is not JSON
            break
    file.write_bytes(changed)


def _is_json(data: bytearray) -> bool:
    try:
        json.loads(data)
    except ValueError:
        return False
    return True


def test_a_change_of_any_file_of_a_build_is_found_by_check(built: Path, tmp_path: Path) -> None:
    names = {f.relative_to(built).as_posix() for f in built.rglob("*") if f.is_file()}
    # No result depends on these two: the second only records which tiles of the stage are done.
    names = {name for name in names if not name.endswith(("seconds.json", "stage.json"))}
    lists = {"stage/files.json", "bundle/files.json", "bundle/manifest.json"}
    lists |= {name for name in names if name.endswith("unit.json")}
    for changed in ({*RECORDS, *OF_UNITS}, lists, names - {*RECORDS, *OF_UNITS} - lists):
        out = shutil.copytree(built, tmp_path / f"out {len(changed)}")
        for name in changed:
            _change(out / name)
        faults = _faults(out)
        assert {name for name in changed if Path(name).name not in faults} == set()
    assert _faults(built) == ""


@pytest.mark.parametrize("name", RECORDS)
def test_changed_record_is_named_with_what_was_found_and_expected(out: Path, name: str) -> None:
    _change(out / name)
    faults = _faults(out)
    assert f"{out / name}: damaged or changed by hand: its content has SHA-256 " in faults
    assert ", expected " in faults
    assert "run `stereocell" in faults


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_plan_of_an_earlier_version_is_refused_with_the_remedy(
    out: Path, built: Path, capfd: pytest.CaptureFixture[str], command: list[str]
) -> None:
    plan = json.loads((out / "plan.json").read_bytes())
    del plan["sha256"]
    (out / "plan.json").write_text(json.dumps(plan))
    assert main([command[0], str(out), *command[1:]]) == 1
    line = error_line(capfd)
    assert "plan.json: found no hash of its content" in line
    assert "an earlier version wrote it" in line
    (out / "plan.json").unlink()  # carries out the remedy
    assert main(["plan", str(built.parent / "f.ome.tif"), "-o", str(out), "--grid", "1x1"]) == 0
    assert (out / "plan.json").read_bytes() == (built / "plan.json").read_bytes()


def test_whole_build_of_an_earlier_version_goes_on_after_the_remedy(
    out: Path, built: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    for name in ("plan.json", "provenance.json", "phases.json", "units/done.json"):
        content = json.loads((out / name).read_bytes())
        del content["sha256"]
        (out / name).write_text(json.dumps(content))
    for name in (SETTINGS, "report/index.html"):
        lines = (out / name).read_bytes().splitlines(keepends=True)
        (out / name).write_bytes(b"".join(lines[:-1]))
    (out / "units" / "plan.key").write_text("0123abcd")
    assert "an earlier version wrote it" in _faults(out)
    build = ["build", str(built.parent / "f.ome.tif"), "-o", str(out), "--grid", "1x1"]
    assert main([*build, "--workers", "0"]) == 1
    assert f"remove it and run `stereocell plan {build[1]} -o {out}`" in error_line(capfd)
    (out / "plan.json").unlink()
    assert main([*build, "--workers", "0"]) == 0
    assert _faults(out) == ""


def test_phases_that_were_changed_by_hand_are_named_and_done_again(
    out: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    _change(out / "phases.json")
    assert main(["bundle", str(out), "--workers", "0"]) == 1
    assert f"run `stereocell units {out} && stereocell stage {out} && " in error_line(capfd)
    assert main(["stage", str(out), "--workers", "0"]) == 0
    assert "phases.json: damaged or changed by hand" in capfd.readouterr().err
    assert main(["bundle", str(out), "--workers", "0"]) == 0
    assert "damaged" not in capfd.readouterr().err


def test_units_of_another_plan_are_not_used(out: Path, capfd: pytest.CaptureFixture[str]) -> None:
    edit_sealed(OutFolder(out).units_plan_file, lambda signed: signed.update(key="0123abcd"))
    assert main(["stage", str(out), "--workers", "0"]) == 1
    assert f"not built for the plan in plan.json: run `stereocell units {out}`" in error_line(capfd)


@pytest.mark.parametrize("name", ["units/plan.key", SETTINGS])
def test_shown_hashes_differ_even_if_only_the_last_digit_of_the_seal_was_changed(
    out: Path, name: str
) -> None:
    file = out / name
    seal = re.findall(r"[0-9a-f]{64}", file.read_text("utf-8"))[-1]
    changed = seal[:-1] + ("0" if seal[-1] != "0" else "1")
    file.write_text(file.read_text("utf-8").replace(seal, changed))
    faults = _faults(out)
    assert (
        f"its content has SHA-256 {seal}, expected {changed}: run `stereocell units" in faults
        or (f"its content has SHA-256 {seal}, expected {changed}: remove it and run" in faults)
    )
    assert faults.count("run `stereocell") == 1


@pytest.mark.parametrize("name", ["units/plan.key", SETTINGS])
def test_remedy_for_a_missing_record_does_not_ask_to_remove_it(out: Path, name: str) -> None:
    (out / name).unlink()
    faults = _faults(out)
    assert f"{out / name} is missing: run `stereocell " in faults
    assert "remove" not in faults


# --- one rule for writing and reading


def test_every_json_file_of_a_build_has_a_row_in_the_table_of_documents(built: Path) -> None:
    for file in [*built.rglob("*.json"), built / "units" / "plan.key"]:
        schema_of(file.name)
        write_bytes(file, file.read_bytes())  # the unchanged content may be written


def _a_name(pattern: str) -> str:
    return pattern.replace("\\", "").replace(".*", "x")


@pytest.mark.parametrize("pattern", [one for one, schema in SCHEMAS.items() if schema])
@pytest.mark.parametrize(
    "write", [write_json, lambda file, c: write_bytes(file, json.dumps(c).encode())]
)
def test_document_that_no_command_could_read_is_not_written(
    tmp_path: Path, pattern: str, write: Callable[[Path, object], None]
) -> None:
    file = tmp_path / _a_name(pattern)
    file.write_text("as it was")
    with pytest.raises(OutputError, match="not written, because no command could read it"):
        write(file, {"of": "another kind"})
    assert file.read_text("utf-8") == "as it was"
    assert list(tmp_path.iterdir()) == [file]


def test_settings_and_numbers_that_no_reader_takes_are_not_written(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="this is not TOML"):
        write_bytes(tmp_path / SETTINGS, b"[plan\n")
    with pytest.raises(OutputError, match="not written"):
        write_json(tmp_path / "seconds.json", {"meshes": float("nan")})
    assert list(tmp_path.iterdir()) == []
