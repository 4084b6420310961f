"""Build a source in a process of its own, while `view` or `serve` shows it."""

import argparse
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from stereocell.engine.run import Watch
from stereocell.read.addresses.resolve import remember, resolve
from stereocell.read.addresses.resolved import Resolved
from stereocell.storage.processes import cores

RunToLine = Callable[[argparse.Namespace], str]  # returns an error in one line; empty: success


def build_behind(
    options: argparse.Namespace, handler: Callable[[argparse.Namespace], object]
) -> Callable[[Path, Watch], str]:
    """Return a function that builds the source with the flags of `view` or `serve`.

    handler  the handler of the command `build`

    The function takes OUT and a watcher of its progress, and returns its error in one line; empty:
    success. It runs in a process of its own, so it and all its values can be pickled.
    """
    build = {"command": "build", "handler": handler, "input": str(options.out), "force": False}
    found = resolve(str(options.out))  # passed on, so that data is not fetched again
    return partial(_build, {**vars(options), **build}, found)


def _build(given: dict[str, Any], found: Resolved, out: Path, watch: Watch) -> str:
    # The module is imported by name. In the first process it is called __main__, and that name
    # means another module here.
    run: RunToLine = import_module("stereocell.cli.__main__").run_to_line
    remember(str(given["input"]), found)
    given = {**given, "out": out, "workers": cores(), "scheduler": "", "watch": watch}
    return run(argparse.Namespace(**given))
