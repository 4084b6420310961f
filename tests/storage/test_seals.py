"""Faults of sealed JSON and of sealed texts are reported in the same words."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path

import pytest

from stereocell.building.out_folder import PLAN_KEY
from stereocell.model.errors import OutputError
from stereocell.storage.json_files import read_sealed, write_sealed
from stereocell.storage.sealed_text import require_sealed_text, write_sealed_text

REMEDY = "run it again"
KEY = {"key": "0123456789abcdef0123"}
SETTINGS = "[plan]\nlevel = 1\n"


def _write_json(file: Path) -> str:
    write_sealed(file, KEY)
    return hashlib.sha256(json.dumps(KEY, sort_keys=True).encode()).hexdigest()


def _write_text(file: Path) -> str:
    write_sealed_text(file, SETTINGS)
    return hashlib.sha256(SETTINGS.encode()).hexdigest()


def _require_json(file: Path) -> None:
    assert read_sealed(file, PLAN_KEY, REMEDY) == KEY


def _require_text(file: Path) -> None:
    require_sealed_text(file, REMEDY)


KINDS = [
    pytest.param("a.json", _write_json, _require_json, id="JSON"),
    pytest.param("a.toml", _write_text, _require_text, id="text"),
]


@pytest.mark.parametrize(("name", "write", "require"), KINDS)
def test_each_fault_of_a_sealed_record_has_one_line_for_both_kinds(
    tmp_path: Path, name: str, write: Callable[[Path], str], require: Callable[[Path], None]
) -> None:
    file = tmp_path / name

    def fault() -> str:
        with pytest.raises(OutputError) as raised:
            require(file)
        line = str(raised.value)
        assert line.startswith(str(file))
        assert line.endswith(f": {REMEDY}")
        return line.removeprefix(str(file)).removesuffix(f": {REMEDY}")

    assert fault() == " is missing"
    digest = write(file)
    require(file)
    sealed = file.read_text("utf-8")
    assert digest in sealed
    other = digest[:20] + ("0" if digest[20] != "0" else "1") + digest[21:]
    file.write_text(sealed.replace(digest, other))
    assert fault() == (
        f": damaged or changed by hand: its content has SHA-256 {digest[:21]}, "
        f"expected {other[:21]}"
    )
    file.write_text(json.dumps(KEY) if name.endswith("json") else SETTINGS)
    line = fault()
    assert line.startswith(": found no hash of its content, expected ")
    assert line.endswith(": an earlier version wrote it, or it was written or changed by hand")
    file.unlink()
    file.mkdir()
    with pytest.raises(OutputError, match=r"can't be read \(Is a directory\)$"):
        require(file)
