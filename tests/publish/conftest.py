"""A bundle, and how a test publishes one by the command line."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from stereocell.cli.__main__ import main
from support.plain_bundle import FILES, write

Run = Callable[..., tuple[int, dict[str, Any], str]]


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """The folder of a small bundle."""
    out = tmp_path / "my out"
    write(out, FILES)
    return out


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    """Publish a folder, and return the exit code, the answer and the last line of stderr."""

    def publish(out: Path, target: object, *more: str) -> tuple[int, dict[str, Any], str]:
        code = main(["publish", str(out), str(target), *more, "--json"])
        printed = capsys.readouterr()
        return (
            code,
            json.loads(printed.out or "{}"),
            printed.err.splitlines()[-1] if printed.err else "",
        )

    return publish
