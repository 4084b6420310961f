"""Build a source behind the page that shows it: `build` with the flags of `view`, in a process."""

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

RunToLine = Callable[[argparse.Namespace], str]  # returns the line of an error; empty: it went well


def build_behind(
    options: argparse.Namespace, handler: Callable[[argparse.Namespace], object]
) -> Callable[[Path, Watch], str]:
    """Return the build of a source, with the flags that `view` or `serve` has been given.

    handler  of the command `build`

    It is called with OUT and is watched, in a process of its own: it is picklable, and so is all
    that it holds. It returns the line of its error; empty: it went well.
    """
    build = {"command": "build", "handler": handler, "input": str(options.out), "force": False}
    found = resolve(str(options.out))  # what was fetched is not fetched again
    return partial(_build, {**vars(options), **build}, found)


def _build(given: dict[str, Any], found: Resolved, out: Path, watch: Watch) -> str:
    # by its name: where Python runs the command's module, that is called __main__, which names
    # another module in this process
    run: RunToLine = import_module("stereocell.cli.__main__").run_to_line
    remember(str(given["input"]), found)
    given = {**given, "out": out, "workers": cores(), "scheduler": "", "watch": watch}
    return run(argparse.Namespace(**given))
