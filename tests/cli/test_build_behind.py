"""The build behind a page reads what the page has fetched."""

import argparse
import pickle
from pathlib import Path

import pytest

from stereocell.cli.build_behind import build_behind
from stereocell.read.addresses import resolve as module
from stereocell.read.addresses.resolve import resolve
from stereocell.read.addresses.resolved import Resolved

ADDRESS = "https://host.example/studies/1.2/series/1.2.3"
FOUND = Resolved("/scratch/dicom", ("a note",))


def source_of(options: argparse.Namespace) -> str:
    """Stand in for a command: return the source that it would read."""
    return resolve(options.input).source


def handler(options: argparse.Namespace) -> None:
    """Stand in for the handler of `build`."""


def test_data_that_the_page_has_fetched_are_not_fetched_again(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[str] = []

    def find(address: str) -> Resolved:
        asked.append(address)
        return FOUND

    monkeypatch.setattr(module, "RESOLVERS", (find,))
    monkeypatch.setattr(module, "_known", {})
    monkeypatch.setattr("stereocell.cli.__main__.run_to_line", source_of)
    build = pickle.dumps(build_behind(argparse.Namespace(out=ADDRESS), handler))
    monkeypatch.setattr(module, "_known", {})  # as in a new process
    assert pickle.loads(build)(tmp_path, lambda *task: None) == FOUND.source
    assert asked == [ADDRESS]
