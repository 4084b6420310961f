"""Build an item of an inbox with a user's choices, in a process that prints nothing.

The lines that a build prints may contain texts from an upload, such as names of files. These do not
belong into the terminal of the server.
"""

import argparse
import os
from functools import partial
from importlib import import_module
from pathlib import Path

from stereocell.cli.build_behind import RunToLine
from stereocell.engine.run import Watch
from stereocell.inbox.address import read_as_stranger
from stereocell.inbox.choices import Choices
from stereocell.live.build_process import Build
from stereocell.read.addresses.resolve import remember
from stereocell.read.addresses.resolved import Resolved
from stereocell.storage.processes import cores


def make_inbox_build(
    source: str, found: Resolved, choices: Choices, out: Path, *, is_stranger: bool
) -> Build:
    """Return a function that builds an item; see `inbox.builds.MakeBuild`."""
    return partial(_build, source, found, choices, out, is_stranger)


def _build(
    source: str, found: Resolved, choices: Choices, out: Path, is_stranger: bool, watch: Watch
) -> str:
    # The module is imported by name. In the first process it is called __main__, and that name
    # means another module here.
    main = import_module("stereocell.cli.__main__")
    run: RunToLine = main.run_to_line
    if is_stranger:
        read_as_stranger()
    _be_silent()
    remember(source, found)
    words = ["build", "--out", str(out), "--title", choices.title]
    if choices.preset:
        words += ["--preset", choices.preset]
    options: argparse.Namespace = main.parse([*words, "--", source])
    for name, value in choices.settings().items():
        setattr(options, name, value)
    options.workers, options.watch = cores(), watch
    return run(options)


def _be_silent() -> None:
    """Discard everything that this process and its workers print."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for stream in (1, 2):
        os.dup2(nowhere, stream)
    os.close(nowhere)
