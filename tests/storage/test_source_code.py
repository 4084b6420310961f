"""The facts found in a source are kept from command to command, and serve that source alone."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from stereocell.storage import source_code

READ = """
import sys
from stereocell.storage import source_code
parse, count = source_code._parsed, []
source_code._parsed = lambda content: count.append(1) or parse(content)
found = [source_code.read_source(text.encode()) for text in sys.argv[1:]]
source_code.keep_sources()
print(len(count), *(source.code for source in found))
"""


def read(home: Path, *texts: str) -> tuple[int, list[str]]:
    """In a process of its own: how many sources were parsed, and their codes."""
    said = subprocess.run(
        [sys.executable, "-c", READ, *texts],
        capture_output=True,
        text=True,
        check=True,
        env={"NUMBA_CACHE_DIR": str(home)},
    ).stdout.split()
    return int(said[0]), said[1:]


@pytest.mark.slow
def test_a_source_is_parsed_once_and_another_by_itself(tmp_path: Path) -> None:
    first = read(tmp_path, "x = 1", "y = 2")
    assert first[0] == 2
    assert read(tmp_path, "x = 1", "y = 2") == (0, first[1])
    count, codes = read(tmp_path, "x = 1", "y = 3")
    assert count == 1
    assert codes[0] == first[1][0]
    assert codes[1] != first[1][1]


@pytest.mark.slow
@pytest.mark.parametrize("text", ["", "[1]", '{"a": 1}', '{"a": ["b"]}', "\0"])
def test_what_is_kept_and_broken_is_found_anew(tmp_path: Path, text: str) -> None:
    expected = read(tmp_path, "x = 1")
    (place,) = tmp_path.glob("sources-*.json")
    place.write_text(text)
    assert read(tmp_path, "x = 1") == expected
    assert len(json.loads(place.read_text("utf-8"))) == 1


@pytest.mark.slow
def test_naming_the_libraries_of_a_result_keeps_the_parsed_sources(tmp_path: Path) -> None:
    code = "from stereocell.storage import cache_key; cache_key.libraries_of(cache_key)"
    env = {"NUMBA_CACHE_DIR": str(tmp_path)}
    subprocess.run([sys.executable, "-c", code], check=True, env=env)
    assert len(list(tmp_path.glob("sources-*.json"))) == 1


def test_where_nothing_can_be_kept_each_command_finds_it(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert read(tmp_path / "file", "x = 1")[0] == 1


def test_names_what_a_module_needs() -> None:
    text = 'import a.b\ndef f():\n    from c import d\n    return find_asset("schemas")'
    source = source_code.read_source(text.encode())
    assert source.imports == ("a.b", "c", "c.d")
    assert source.assets == ("schemas",)
