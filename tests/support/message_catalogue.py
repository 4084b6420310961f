"""Collect an example of each message that the tests provoke, so that all can be read in one go.

`make test` writes them to out/messages.md: errors by the place that raises them, and notes on
sources. The plugin works where the environment variable STEREOCELL_MESSAGES names that file.
"""

import ast
import os
import re
import sys
from pathlib import Path
from typing import Any

import pytest

import stereocell
from stereocell.model.errors import StereoCellError
from stereocell.planning.plan import Plan
from stereocell.read.image import Image

PACKAGE = Path(stereocell.__file__).parent
FILE = os.environ.get("STEREOCELL_MESSAGES", "")
NOTES = "notes"
# By module and line of code, or by NOTES and the pattern of a note: an example
Messages = dict[str, dict[str, str]]


def _without_values(text: str) -> str:
    """Return the pattern of a note. Notes that differ only in values have the same pattern."""
    return re.sub(r"'[^']*'|\S*\d\S*", "X", text)


class MessageCatalogue:
    """Records messages in one process of pytest, and writes those of all processes together."""

    def __init__(self) -> None:
        self.messages: Messages = {NOTES: {}}

    def record(self) -> None:
        """Start to record; recording ends with this process."""
        StereoCellError.__init__ = self._recording_error(Exception.__init__)
        for noted in (Image, Plan):
            noted.__init__ = self._recording_notes(noted.__init__)

    def _recording_error(self, before: Any) -> Any:
        def init(error: StereoCellError, *args: Any) -> None:
            before(error, *args)
            frame = sys._getframe(1)
            place = Path(frame.f_code.co_filename)
            if place.is_relative_to(PACKAGE):
                module = place.relative_to(PACKAGE).as_posix()
                self.messages.setdefault(module, {}).setdefault(f"{frame.f_lineno:5}", str(error))

        return init

    def _recording_notes(self, before: Any) -> Any:
        def init(noted: Image | Plan, *args: Any, **fields: Any) -> None:
            before(noted, *args, **fields)
            for note in noted.notes:
                self.messages[NOTES].setdefault(_without_values(note), note)

        return init

    def add(self, messages: Messages) -> None:
        for module, examples in messages.items():
            self.messages[module] = examples | self.messages.get(module, {})

    def pytest_testnodedown(self, node: Any) -> None:
        self.add(node.workeroutput.get("messages", {}))

    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        worker = getattr(session.config, "workeroutput", None)
        if worker is not None:
            worker["messages"] = self.messages
        else:
            Path(FILE).parent.mkdir(parents=True, exist_ok=True)
            Path(FILE).write_text(_page(self.messages), "utf-8")


def _page(messages: Messages) -> str:
    lines = ["# Messages, each with an example from the tests", ""]
    for module, examples in sorted(messages.items()):
        lines += ["", f"## {module}", ""]
        lines += [f"- {' '.join(examples[key].split())}" for key in sorted(examples)]
    raises = {
        f"{path.relative_to(PACKAGE).as_posix()}:{node.lineno}"
        for path in PACKAGE.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Raise)
        and isinstance(node.exc, ast.Call)
        and _name(node.exc) in ERRORS
    }
    seen = {
        f"{module}:{int(key)}" for module in messages if module != NOTES for key in messages[module]
    }
    lines += ["", "## Errors that no test of this run provoked in its own process", ""]
    lines += [f"- {place}" for place in sorted(raises - seen)]
    return "\n".join(lines) + "\n"


def _name(call: ast.Call) -> str:
    return getattr(call.func, "id", getattr(call.func, "attr", ""))


ERRORS = {StereoCellError.__name__, *(kind.__name__ for kind in StereoCellError.__subclasses__())}


def pytest_configure(config: pytest.Config) -> None:
    if FILE:
        catalogue = MessageCatalogue()
        catalogue.record()
        config.pluginmanager.register(catalogue)
