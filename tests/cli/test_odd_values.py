"""Odd values of every flag of `plan`: it works, or one line says what was given."""

from pathlib import Path

import pytest

from stereocell.cli.__main__ import _parser, main
from support import phantoms

VALUES = ("nan", "9" * 400, "a\nb\0", "1e308,1e308,1e308", "F=1e308", "0:9" * 9, "\ud800", "--")
PLAN = _parser()._subparsers._group_actions[0].choices["plan"]  # type: ignore[union-attr]
FLAGS = sorted(
    option
    for action in PLAN._actions
    if action.nargs != 0
    for option in action.option_strings
    if option.startswith("--") and option != "--out"
)


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("source")
    return phantoms.write_ome_tiff(folder / "f.ome.tif", phantoms.f_phantom(), names=["F"])


@pytest.mark.parametrize("flag", FLAGS)
def test_an_odd_value_is_one_line_at_most(
    source: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    flag: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    for i, value in enumerate(VALUES):
        code = main(["plan", str(source), "-o", f"out{i}", f"{flag}={value}"])
        lines = capsys.readouterr().err.splitlines()
        assert code in (0, 1, 2)
        assert (code == 0) or (len(lines) == 1 and len(lines[0]) < 900), (value, lines)
