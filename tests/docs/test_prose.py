"""The check of prose finds each kind of fault in each kind of file, and accepts plain texts."""

from pathlib import Path

import pytest

from support import prose

FAULTS = {
    "a.py": '# Of the longest edge.\ndef f() -> None:\n    """Whoever reads it."""\n',
    "b.py": 'raise ValueError(f"{a}: made anew from {b} and {c}")\n',
    "test_c.py": "def test_what_frays_is_less() -> None: ...\n",
    "d.ts": "/** Those that are done. */\nconst text = `What is left of ${n} points.`;\n",
    "e.glsl": "// It is as before.\n",
    "f.md": "# Title\n\nThe picture is told by turns of the rung.\n",
    "g.schema.json": '{\n  "title": "Of the eye, in the world"\n}\n',
    "Makefile": "# " + "word " * (prose.MAX_WORDS + 1) + "\nall:\n",
}
PLAIN = {
    "a.py": '"""Read files.\n\n    n  number of `files`. `More` are not read\n"""\n\nN = 3  # m\n',
    "b.ts": "// Draws the frame again.\nconst text = `of ${n} points`;\n",
    "c.md": "What to do if it fails?\n\n| Of | Those |\n|---|---|\n\n- of a list\n",
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_printed_with_its_line(
    tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_text(FAULTS[name], "utf-8")
    assert prose.main([str(tmp_path / name)]) == 1
    assert f"{name}:" in capsys.readouterr().out


@pytest.mark.parametrize("name", PLAIN)
def test_plain_text_passes(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / name).write_text(PLAIN[name], "utf-8")
    assert prose.main([str(tmp_path / name)]) == 0, capsys.readouterr().out
