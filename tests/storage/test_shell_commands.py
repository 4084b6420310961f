"""Commands in messages have real paths, so that they can be pasted into a shell."""

import ast
import re
import shlex
import subprocess
from pathlib import Path

import pytest

import stereocell
from stereocell.cli.__main__ import COMMANDS, main
from stereocell.cli.places import PLACES
from stereocell.storage.shell_commands import fill_in
from support.outputs import make_source

ODD = 'it\'s "mine" & $HOME; (1)'
SOURCES = Path(stereocell.__file__).parent
KNOWN = {"OUT", "INPUT", "TARGET", "ANOTHER_OUT"}  # ANOTHER_OUT is for the user to choose
COMMAND = re.compile(r"`(stereocell [^`]*)`")


@pytest.mark.parametrize("place", ["out/mine", ODD, "two  words", "a`b", "-x y"])
def test_a_shell_reads_the_real_path_from_a_command_in_a_message(place: str) -> None:
    places = {"OUT": place, "INPUT": "in put"}
    line = fill_in("x: run `stereocell plan INPUT -o OUT` first", places)
    command = line.removeprefix("x: run `stereocell").removesuffix("` first")
    done = subprocess.run(
        ["sh", "-c", f"printf '%s\\n' {command}"], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == ["plan", "in put", "-o", place]


def test_words_for_unknown_paths_stay_in_a_message() -> None:
    line = "OUT: run `stereocell build INPUT -o ANOTHER_OUT`, then `stereocell publish OUT TARGET`"
    assert fill_in(line, {"OUT": "a"}) == line.replace("publish OUT", "publish a")


def test_each_word_for_a_path_in_a_message_can_be_filled_in() -> None:
    named = {
        (file.relative_to(SOURCES).as_posix(), word)
        for file in SOURCES.rglob("*.py")
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
        for command in COMMAND.findall(node.value)
        for word in re.findall(r"\b[A-Z][A-Z_]+\b", command)
    }
    assert named >= {("building/out_folder.py", "OUT"), ("planning/plan_file.py", "INPUT")}
    assert {one for one in named if one[1] not in KNOWN and one[0] != "export/__init__.py"} == set()


def _pasted(capfd: pytest.CaptureFixture[str]) -> list[str]:
    """Return the words after `stereocell` of the one command that an error names."""
    printed = capfd.readouterr().err
    (line,) = [line for line in printed.splitlines() if line.startswith("stereocell: ")]
    (command,) = COMMAND.findall(line)
    return shlex.split(command)[1:]


def test_following_remedies_leads_from_an_empty_folder_to_a_stage(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source, out = make_source(tmp_path / f"{ODD}.ome.tif"), tmp_path / ODD
    assert main(["units", str(out), "--workers", "0"]) == 1
    words = _pasted(capfd)
    assert words == ["plan", "INPUT", "-o", str(out)]  # INPUT stays, because no input was given
    assert main(["plan", str(source), *words[2:], "--grid", "1x1"]) == 0
    capfd.readouterr()
    assert main(["stage", str(out), "--workers", "0"]) == 1
    words = _pasted(capfd)
    assert words == ["units", str(out)]
    assert main([*words, "--workers", "0"]) == 0
    (out / "plan.json").write_text("{}")
    capfd.readouterr()
    assert main(["build", str(source), "-o", str(out)]) == 1
    assert _pasted(capfd) == ["plan", str(source), "-o", str(out)]
    with pytest.raises(stereocell.StereoCellError) as raised:
        stereocell.build(source, out)
    (command,) = COMMAND.findall(str(raised.value))
    assert shlex.split(command)[1:] == ["plan", str(source), "-o", str(out)]


@pytest.mark.parametrize("name", sorted(name for name, at in PLACES.items() if at.reads))
def test_a_command_on_an_empty_folder_names_that_folder(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str
) -> None:
    out = tmp_path / ODD
    out.mkdir()
    more = {"export": ["x.glb"], "publish": [str(tmp_path / "site")]}.get(name, [])
    assert name in COMMANDS
    assert main([name, str(out), *more]) == 1
    assert str(out) in _pasted(capfd)


def test_check_names_the_build_around_a_bundle(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / ODD
    (out / "bundle").mkdir(parents=True)
    (out / "plan.json").write_text('{"format": "stereocell-plan"}')
    for name in ("manifest.json", "files.json"):
        (out / "bundle" / name).write_text('{"format": "stereocell-bundle"}')
    assert main(["check", str(out / "bundle")]) == 1
    commands = COMMAND.findall(capfd.readouterr().out)
    assert commands
    assert {tuple(shlex.split(one)) for one in commands} == {("stereocell", "bundle", str(out))}
