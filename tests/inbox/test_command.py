"""`stereocell serve --inbox FOLDER` as a command: its flags, its output and its end."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from stereocell.cli.__main__ import main


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (
            [],
            "`stereocell serve` has nothing to show, expected a build, a volume or --inbox FOLDER",
        ),
        (["out", "--inbox", "box"], "--inbox and out are both given, expected one of them"),
        (["out", "--inbox-gb", "2"], "--inbox-gb is given without --inbox FOLDER, expected both"),
        (
            ["--inbox", "box", "--preset", "ct"],
            "--preset does not apply to an inbox, whose users choose in the page: leave it out",
        ),
        (
            ["--inbox", "box", "--title", "Knee"],
            "--title does not apply to an inbox, whose users choose in the page: leave it out",
        ),
        (
            ["--inbox", "box", "--allow-frame", "https://a.example"],
            "--allow-frame does not apply to an inbox, whose users choose in the page",
        ),
    ],
)
def test_flags_that_make_no_sense_are_refused(
    words: list[str], expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["serve", *words]) == 2
    assert expected in capsys.readouterr().err


@pytest.mark.slow
def test_an_inbox_is_served_until_sigterm_by_one_command_at_a_time(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "stereocell.cli", "serve", "--inbox", "box", "--json"]
    command += ["--port", "0", "--inbox-gb", "2"]
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as server:
        assert server.stdout is not None
        try:
            printed = json.loads(server.stdout.readline())
            assert printed["inbox"] == str(tmp_path / "box")
            second = subprocess.run(
                command, cwd=tmp_path, capture_output=True, text=True, check=False
            )
        finally:
            server.send_signal(signal.SIGTERM)
            printed = server.communicate(timeout=60)
    assert (server.returncode, printed) == (0, ("", ""))
    assert second.returncode == 1
    assert "`stereocell serve` (process" in second.stderr
    assert os.listdir(tmp_path / "box") == ["inbox.json"]
