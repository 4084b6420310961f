"""The command `stereocell`: one subcommand per phase, and one that runs them all."""

import argparse
import gc
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from io import TextIOWrapper
from pathlib import Path
from typing import NoReturn

from stereocell.cli import commands, flags
from stereocell.cli.commands import Handler
from stereocell.cli.places import FORCE, PLACES, require_place
from stereocell.cli.words import prepared
from stereocell.engine.interrupts import Terminated, answering_sigterm
from stereocell.model.errors import StereoCellError, UsageError
from stereocell.storage.processes import keep_freed_memory, require_address_space, shortage

# New objects between two garbage collections. With Python's default of 700, collections take a
# tenth of a command's time.
_GARBAGE_AFTER = 20_000
EXIT_CODES = """exit codes:
  0    success
  1    an error, reported in one line; `check`: a check failed; `doctor`: a required part is missing
  2    wrong usage
  130  stopped by Ctrl+C; the same command continues
  141  the reader of the output stopped reading, as `| head` does
  143  stopped by SIGTERM; the same command continues"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code; see EXIT_CODES."""
    gc.set_threshold(_GARBAGE_AFTER, *gc.get_threshold()[1:])
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):  # escape characters that the encoding lacks
            stream.reconfigure(errors="backslashreplace")
    try:
        return _main(sys.argv[1:] if arguments is None else arguments)
    except commands.StdoutLost as lost:
        # Python flushes stdout again at exit, which would fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        error = lost.error
    if isinstance(error, BrokenPipeError):
        return 141  # the code that shells report for SIGPIPE
    print(f"stereocell: stdout: {error.strerror or error}", file=sys.stderr)
    return 1


def _main(words: Sequence[str]) -> int:
    options = argparse.Namespace(json="--json" in words)  # replaced once the words are parsed
    try:
        options = parse(words)
        if options.command not in LIGHT | SHOWERS:
            keep_freed_memory()
        with answering_sigterm():
            return _run(options)
    except (StereoCellError, MemoryError, RuntimeError, ImportError, OSError) as error:
        code = error.exit_code if isinstance(error, StereoCellError) else 1
        return _fail(options, _line_of(options, error), code)
    except KeyboardInterrupt as stop:
        code = 143 if isinstance(stop, Terminated) else 130
        return _fail(options, "stopped; the same command continues from here", code)


def _line_of(options: argparse.Namespace, error: Exception) -> str:
    """Return one line for an error that a user can mend, such as a damaged file or a full disk.

    All other errors are bugs and are raised again.
    """
    if isinstance(error, StereoCellError):
        from stereocell.storage.shell_commands import fill_in

        return fill_in(flags.as_typed(options, str(error)), getattr(options, "places", {}))
    if words := shortage(error):
        return words
    if isinstance(error, ModuleNotFoundError):
        return (
            f"the package {error.name} is missing: install StereoCell again "
            "(`stereocell doctor` lists all missing packages)"
        )
    if type(error).__module__ == "pxr.Tf":
        from stereocell.usd.typed_values import one_line

        return f"USD refuses a layer of the stage: {one_line(error)}: run `stereocell check OUT`"
    if isinstance(error, OSError):  # the disk is full, a folder was removed
        place = f"{error.filename}: " if error.filename else ""
        return f"{place}{error.strerror or error}"
    raise error


def parse(words: Sequence[str]) -> argparse.Namespace:
    """Return the arguments of a command. Raises UsageError."""
    return _parser(words).parse_args(prepared(words))


def run_to_line(options: argparse.Namespace) -> str:
    """Run a command inside another one, and return its error in one line; empty: success.

    Raises KeyboardInterrupt if the command is stopped.
    """
    try:
        with answering_sigterm():
            _run(options)
    except (StereoCellError, MemoryError, RuntimeError, ImportError, OSError) as error:
        return _line_of(options, error)
    return ""


def _fail(options: argparse.Namespace, line: str, code: int) -> int:
    line = commands.with_given_names(options, line)
    print(f"stereocell: {_shortened(line)}", file=sys.stderr)
    if options.json:
        commands.print_line(commands.to_json({"error": line, "exit_code": code}))
    return code


def _shortened(line: str) -> str:
    """Return lines of which the middle is cut out if they are very long."""
    lines = commands.plain(line).split("\n")
    return "\n".join(one if len(one) < 1200 else f"{one[:700]} ... {one[-400:]}" for one in lines)


def _run(options: argparse.Namespace) -> int:
    """Run a command. A command that writes into OUT locks it first."""
    out, name = getattr(options, "out", None), options.command
    options.shown, options.is_source = out, False
    if name in SHOWERS and commands.is_inbox(options):
        return commands.answer(options, commands.serve_inbox(options))
    if name in SHOWERS:
        from stereocell.live.is_source import is_source

        options.is_source = is_source(options.out)
    if name not in LIGHT:
        require_address_space(name)
        options.places = _given_places(options)
    with ExitStack() as stack:
        if options.is_source:
            return commands.answer(options, options.handler(options))
        if PLACES[name].writes:
            from stereocell.storage.overwriting import AT_A_PROMPT, forcing

            stack.enter_context(forcing(options.force, AT_A_PROMPT))
        if isinstance(out, str):  # OUT is an address, not a local path
            if name not in WRITERS | READERS.keys():
                from stereocell.storage.location import Location

                shown = Location.of(out).shown
                raise UsageError(f"OUT is {shown}, expected a folder or a file on this machine")
            from stereocell.storage.workspace import opened

            is_writer = name in WRITERS
            options.out = stack.enter_context(
                opened(out, command=name) if is_writer else opened(out, only=READERS[name])
            )
        elif name in WRITERS and hasattr(options, "input"):
            from stereocell.read.source_place import require_apart

            require_apart(options.input, options.out)
        if name in WRITERS | READERS.keys():
            options.places |= require_place(options)
        if isinstance(out, Path) and name in WRITERS:
            from stereocell.storage.lock import alone_in

            stack.enter_context(alone_in(options.out, name))
        handler: Handler = options.handler
        return commands.answer(options, handler(options))


def _given_places(options: argparse.Namespace) -> dict[str, str]:
    """Return INPUT and TARGET of a command, to be filled into the remedies of messages."""
    from stereocell.storage.shell_commands import as_shown

    given = {"INPUT": getattr(options, "input", None), "TARGET": getattr(options, "target", None)}
    return {word: as_shown(place) for word, place in given.items() if place}


class _Parser(argparse.ArgumentParser):
    """Reports errors as commands do, in one line, and in JSON with --json."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message}; `{self.prog} --help` lists all flags")


def _parser(words: Sequence[str] | None = None) -> argparse.ArgumentParser:
    """Return the parser of all commands.

    words  declare the flags of the commands among these words alone, which is faster; None: all
    """
    parser = _Parser(
        prog="stereocell",
        description="Turn a multi-channel volume into a USD stage, a web bundle and a stereo view.",
        epilog="example: stereocell build my.ome.zarr -o out/mine && stereocell view out/mine\n\n"
        + EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    subparsers = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, (about, example, declare, handler) in COMMANDS.items():
        command = subparsers.add_parser(
            name,
            help=about,
            description=f"{about[0].upper()}{about[1:]}.",
            epilog=f"example: stereocell {example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if words is None or name in words:
            declare(command)
            if PLACES[name].writes:
                command.add_argument("--force", action="store_true", help=FORCE)
        command.set_defaults(handler=handler, command=name)
        form = "one JSON object" if name not in SHOWERS else "JSON objects, one per line,"
        command.add_argument("--json", action="store_true", help=f"print {form} on stdout")
    return parser


COMMANDS: dict[str, tuple[str, str, Callable[[argparse.ArgumentParser], None], Handler]] = {
    "build": (
        "build everything: plan, units, stage, bundle and report",
        "build my.ome.zarr -o out/mine --preset cycif --grid 5x2",
        flags.declare_build,
        commands.build,
    ),
    "plan": (
        "plan a build: resolution level, region, tiles and channels",
        "plan my.ome.tif -o out/mine --channels CD31,MART1",
        flags.declare_input,
        commands.plan,
    ),
    "iso": (
        "draw slices of one tile with the contours of all iso-values found",
        "iso my.ome.zarr --channel CD31 --tile r0_c0 -o cd31.png --preset cycif --grid 5x2",
        flags.declare_iso,
        commands.iso,
    ),
    "slices": (
        "write upright 8-bit PNG slices of one channel, and a JSON file of positions and window",
        "slices scans/head -o out/slices --preset mri --plane axial",
        flags.declare_slices,
        commands.slices,
    ),
    "units": (
        "find iso-values, and build meshes and volumes of every tile and channel",
        "units out/mine --workers 4 --only r0_c3/CD31",
        flags.declare_units,
        commands.one_phase("units"),
    ),
    "stage": (
        "write the USD stage from the units",
        "stage out/mine",
        flags.declare_stage,
        commands.one_phase("stage"),
    ),
    "bundle": (
        "write the web bundle from the composed USD stage",
        "bundle out/mine --stage edited.usda",
        flags.declare_bundle,
        commands.one_phase("bundle"),
    ),
    "export": (
        "write one file for another program: Blender, a 3D printer, Slicer, PowerPoint, ...",
        "export out/mine cells.glb --channels CD31 --max-triangles 200000",
        flags.declare_export,
        commands.export,
    ),
    "publish": (
        "put the bundle on a web host, and check every file that the host sends",
        "publish out/mine s3://bucket/mine",
        flags.declare_publish,
        commands.publish,
    ),
    "report": (
        "write a page with pictures, sizes and times",
        "report out/mine",
        flags.declare_report,
        commands.one_phase("report"),
    ),
    "tissue": (
        "find tissue classes, and build the probability of each as a channel",
        "tissue out/head --classes 3",
        flags.declare_tissue,
        commands.tissue,
    ),
    "check": (
        "check all files by the rules of their formats, and with --deep by their source",
        "check out/mine --deep",
        flags.declare_check,
        commands.check,
    ),
    "view": (
        "show a build in a browser, or a volume while it is built; --lan: on phones too",
        "view my.ome.tif; stereocell view out/mine --lan",
        flags.declare_view,
        commands.view,
    ),
    "serve": (
        "serve a build, or a volume while it is built, without opening a browser",
        "serve out/mine --lan",
        flags.declare_serve,
        commands.serve,
    ),
    "sample": (
        "write a sample volume; no network is needed",
        "sample cycif demo.ome.zarr --grid 5x2 --seed 1",
        flags.declare_sample,
        commands.sample,
    ),
    "doctor": (
        "list the parts of this machine that StereoCell uses, and what is missing",
        "doctor",
        flags.declare_nothing,
        commands.doctor,
    ),
    "settings": (
        "print every setting as TOML, with its default and a comment",
        "settings --preset cycif > stereocell.toml",
        flags.declare_settings,
        commands.settings,
    ),
}

# Commands that write into OUT, one at a time
WRITERS = frozenset({"build", "plan", "units", "stage", "bundle", "report", "tissue"})
# Commands that can read an OUT on object storage, and the folder to fetch first; "": all of OUT
READERS = {
    "check": "",
    "export": "stage",
    "publish": "bundle",
    "view": "bundle",
    "serve": "bundle",
}
# Commands that show a build or a source
SHOWERS = frozenset({"view", "serve"})
# Commands that import no large library
LIGHT = frozenset({"settings", "doctor"})

if __name__ == "__main__":
    sys.exit(main())
