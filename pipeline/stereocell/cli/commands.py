"""Run the commands and print their answers.

Lines for people are printed at once. With --json these lines are left out, and one JSON object is
printed at the end. Progress and errors always go to stderr. Large libraries are imported inside of
functions, so that --help is quick.
"""

import argparse
import json
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stereocell.cli.flags import flags_of, given_flags, numbers
from stereocell.model.errors import UsageError, shortened

if TYPE_CHECKING:
    from stereocell.engine.run import Engine
    from stereocell.live.show_source import Live
    from stereocell.verify.check_line import CheckLine


@dataclass(frozen=True, slots=True)
class Answer:
    """The answer of a command: data for --json, and the exit code."""

    data: Mapping[str, Any] = field(default_factory=dict)
    code: int = 0


Handler = Callable[[argparse.Namespace], Answer]


class StdoutLost(Exception):
    """The answer can't be printed, because stdout is closed or full. `error` has the reason."""

    def __init__(self, error: OSError) -> None:
        super().__init__(error)
        self.error = error


def print_line(text: str) -> None:
    """Print a line on stdout and flush it. Raises StdoutLost."""
    try:
        print(text, flush=True)
    except OSError as error:
        raise StdoutLost(error) from error


def print_unless_json(options: argparse.Namespace, text: str) -> None:
    """Print a text for a person, unless --json is given."""
    if not options.json:
        print_line(plain(_as_given(options, text)))


def plain(text: str) -> str:
    """Escape control characters, which names and contents of files may have; keep line ends."""
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text
    )


def with_given_names(options: argparse.Namespace, text: str) -> str:
    """Return a text in which long names from the command line are cut, and line breaks escaped."""
    for given in map(str, vars(options).values()):
        shown = shortened(given).replace("\n", "\\n")
        if shown != given:
            text = text.replace(given, shown)
    return text


def answer(options: argparse.Namespace, found: Answer) -> int:
    """Print the answer's data with --json; return the exit code."""
    if options.json and found.data:
        print_line(_as_given(options, to_json(found.data)))
    return found.code


def to_json(data: Mapping[str, Any]) -> str:
    """Return one line of JSON. Characters that stdout can't print are escaped."""
    text = json.dumps(data, allow_nan=False, ensure_ascii=False)
    return text if _can_be_printed(text) else json.dumps(data, allow_nan=False)


def _can_be_printed(text: str) -> bool:
    """Return whether stdout can encode the text and a terminal can show it."""
    try:
        text.encode(sys.stdout.encoding or "utf-8")
    except UnicodeEncodeError:
        return False
    return text.isprintable()


def _as_given(options: argparse.Namespace, text: str) -> str:
    """Return a text in which an OUT on object storage has its address, not its local folder."""
    text = with_given_names(options, text)
    is_kept = isinstance(getattr(options, "shown", None), str)
    return text.replace(str(options.out), options.shown.rstrip("/")) if is_kept else text


def settings(options: argparse.Namespace) -> Answer:
    """Print the settings of a preset and a file as TOML."""
    from stereocell.planning import settings as settings_module

    found = settings_module.load(options.preset, options.config, flags={})
    print_unless_json(
        options, settings_module.to_toml(found, header=settings_module.TEMPLATE).removesuffix("\n")
    )
    return Answer(settings_module.to_dict(found))


def _series(options: argparse.Namespace) -> Answer | None:
    """List the series of a source, if --series is `list`."""
    if options.series != "list":
        return None
    from stereocell import read
    from stereocell.read.addresses.resolve import resolve

    source = resolve(options.input).source
    lines = read.list_series(source)
    order = read.series_order(source) if len(lines) > 1 else ""
    print_unless_json(options, "\n".join([*lines, *([f"order: {order}"] if order else [])]))
    return Answer({"series": list(lines)})


def _require_found(source: str) -> None:
    """Raise SourceError for a missing path, before large libraries are imported."""
    from stereocell.read.readers import require_found
    from stereocell.storage.location import Location

    require_found(Location.of(source))


def plan(options: argparse.Namespace) -> Answer:
    """Write the plan and print it."""
    return _series(options) or _plan(options, None)


def _plan(options: argparse.Namespace, engine: "Engine | None") -> Answer:
    """Write the plan. `engine` has the workers of the phases that follow, if any do."""
    from stereocell.building import phases
    from stereocell.planning.preset_choice import load_for

    flags = flags_of(options)
    wanted, choice = load_for(options.input, options.preset, options.config, flags=flags)
    made = phases.make_plan(
        options.input, options.out, wanted, choice=choice, title=options.title or "", engine=engine
    )
    return Answer(
        {
            "out": str(options.shown),
            "name": made.name,
            "level": made.level,
            "shape": list(made.region.shape),
            "spacing_um": list(made.spacing_um),
            "tiles": [tile.id for tile in made.tiles],
            "channels": [channel.name for channel in made.channels],
        }
    )


def iso(options: argparse.Namespace) -> Answer:
    """Write a picture of one tile's iso-values, and print them."""
    if listed := _series(options):
        return listed
    _require_found(options.input)
    from stereocell.planning.preset_choice import load_for, print_choice
    from stereocell.preview import iso_value as iso_preview

    if options.out is not None:
        iso_preview.require_picture_or_nothing(options.out)
    flags = flags_of(options)
    wanted, choice = load_for(options.input, options.preset, options.config, flags=flags)
    found, path = iso_preview.preview(
        options.input, options.channel, tile_id=options.tile, out=options.out, settings=wanted
    )
    print_choice(choice)
    print_unless_json(options, "\n".join(iso_preview.table(found)))
    print_unless_json(options, f"wrote {path}")
    return Answer({"picture": str(path), **asdict(found)})


def run_phases(options: argparse.Namespace, *names: str) -> Answer:
    """Run phases of a build, in the given order."""
    out, engine = _workers_of(options)
    try:
        return _run_phases(options, out, engine, names)
    finally:
        engine.close()


def _workers_of(options: argparse.Namespace) -> "tuple[Path, Engine]":
    """Return OUT by a path that the workers can use, and the workers. Raises UsageError."""
    from stereocell.engine.run import Engine
    from stereocell.storage.claim import LOCK

    scheduler, edited = getattr(options, "scheduler", ""), getattr(options, "stage", None)
    is_kept = isinstance(options.shown, str)  # OUT is on object storage, and workers open it
    if is_kept and edited:
        raise UsageError(
            f"--stage is {edited}, but OUT is {options.shown}, on object storage, expected OUT in "
            "a folder: copy the build there"
        )
    out = options.out.absolute() if scheduler else options.out  # workers may run in another folder
    shared = None if is_kept else out / LOCK
    watch = getattr(options, "watch", None)
    return out, Engine(getattr(options, "workers", 0), scheduler, shared, watch)


def _run_phases(
    options: argparse.Namespace, out: Path, engine: "Engine", names: Sequence[str]
) -> Answer:
    from stereocell.building import phases
    from stereocell.building.out_folder import OutFolder

    for name in names:
        if name == "units":
            phases.run_units(out, engine, only=getattr(options, "only", None))
        elif name == "stage":
            phases.run_stage(out, engine)
        elif name == "bundle":
            edited, is_strict = (getattr(options, name, None) for name in ("stage", "strict"))
            phases.run_bundle(out, engine, stage=edited, is_strict=bool(is_strict))
        else:
            from stereocell.report import (
                phase,
            )  # imported here, since drawing needs large libraries

            engine.watch("report", 0, 1, "")
            texture_similarity = getattr(options, "texture_similarity", False)
            phase.run_report(out, engine, texture_similarity=texture_similarity)
    seconds = {name: phase["seconds"] for name, phase in OutFolder(out).phases().items()}
    results = {
        "stage": "stage/stage.usda",
        "bundle": "bundle/index.html",
        "report": "report/index.html",
    }
    made = {name: f"{options.shown}/{file}" for name, file in results.items() if name in names}
    return Answer({"out": str(options.shown), "seconds": seconds, **made})


def one_phase(name: str) -> Handler:
    """Return the handler of the command that runs one phase."""
    return lambda options: run_phases(options, name)


def build(options: argparse.Namespace) -> Answer:
    """Run all phases."""
    if listed := _series(options):
        return listed
    out, engine = _workers_of(options)
    try:
        planned = _plan(options, engine)
        made = _run_phases(options, out, engine, ("units", "stage", "bundle", "report"))
    finally:
        engine.close()
    for name in ("stage", "bundle", "report"):
        print_unless_json(options, f"{name:<8} {made.data[name]}")
    print_unless_json(options, f"look at it: stereocell view {shlex.quote(str(options.shown))}")
    return Answer({**planned.data, **made.data})


def slices(options: argparse.Namespace) -> Answer:
    """Write PNG slices of one channel."""
    if listed := _series(options):
        return listed
    _require_found(options.input)
    from stereocell.planning.plan_notes import print_notes
    from stereocell.planning.preset_choice import load_for
    from stereocell.planning.settle import settle
    from stereocell.preview.png_slices import (
        require_slices_or_nothing,
        without_surface,
        write_slices,
    )
    from stereocell.read.source_place import require_apart

    require_apart(options.input, options.out)
    require_slices_or_nothing(options.out)
    flags = flags_of(options)
    wanted, choice = load_for(options.input, options.preset, options.config, flags=flags)
    plan = settle(options.input, without_surface(wanted), choice)
    print_notes(plan)
    written = write_slices(plan, options.out, plane=options.plane)
    print_unless_json(options, f"wrote to {options.out}: {written.line}")
    return Answer({"out": str(options.out), "slices": written.count, "plane": written.plane})


def sample(options: argparse.Namespace) -> Answer:
    """Write the files of a sample specimen, to try the other commands on."""
    from stereocell import samples

    if options.name == "cycif":
        columns, _, rows = options.grid.partition("x")
        if not (columns.isdecimal() and rows.isdecimal() and int(columns) and int(rows)):
            raise UsageError(f"--grid is {options.grid!r}, expected columns x rows, such as 5x2")
        z, y, x = numbers(options.tile_size, int, "--tile-size")
        samples.write_cycif(
            options.out,
            grid=(int(columns), int(rows)),
            tile_size=(z, y, x),
            seed=options.seed,
            brightness_spread=options.brightness_spread,
        )
    elif options.name == "mri":
        samples.write_head(options.out, seed=options.seed)
    elif options.name == "cells":
        samples.write_cells(options.out, seed=options.seed)
    else:
        samples.write_brain_cells(options.out)
    print_unless_json(options, f"wrote {options.out}")
    return Answer({"out": str(options.out)})


def tissue(options: argparse.Namespace) -> Answer:
    """Learn tissue classes and build their channels."""
    from stereocell.building.out_folder import OutFolder
    from stereocell.building.sealed_documents import require_documents

    out_folder = OutFolder(options.out)
    require_documents(out_folder, "tissue")
    out_folder.plan()  # a missing plan is reported before large libraries are imported
    from stereocell.building.model_process import ModelBounds
    from stereocell.building.tissue import TissueRequest, add_tissue, parse_classes

    classes = None if options.classes is None else parse_classes(options.classes)
    bounds = ModelBounds(options.model_seconds, options.model_memory_gb)
    request = TissueRequest(classes, options.channel, options.model, options.everywhere, bounds)
    add_tissue(options.out, request)
    return run_phases(options, "units", "stage", "bundle", "report")


def check(options: argparse.Namespace) -> Answer:
    """Check the results. The exit code is 1 if a check fails."""
    from stereocell.storage.shell_commands import fill_in
    from stereocell.verify.formats import check as run

    lines = []
    for line in chain(run(options.out), _deep(options) if options.deep else ()):
        detail = fill_in(line.detail, options.places)
        lines.append({**asdict(line), "detail": detail})
        print_unless_json(options, f"{'ok  ' if line.ok else 'FAIL'} {line.name}: {detail}")
    is_sound = all(line["ok"] for line in lines)
    return Answer({"ok": is_sound, "checks": lines}, 0 if is_sound else 1)


def _deep(options: argparse.Namespace) -> "Iterator[CheckLine]":
    from stereocell.engine.run import Engine
    from stereocell.verify.deep import check_deep

    out = options.out.absolute()  # workers may run in another folder
    is_kept = isinstance(options.shown, str)
    engine = Engine(options.workers, options.scheduler, None if is_kept else out / "plan.json")
    try:
        yield from check_deep(out, engine, options.stage and options.stage.absolute())
    finally:
        engine.close()


def export(options: argparse.Namespace) -> Answer:
    """Write one file for another program."""
    from dataclasses import fields

    from stereocell.engine.run import console
    from stereocell.export.export_build import export as write
    from stereocell.export.options import ExportOptions, parse_region

    given: dict[str, Any] = {
        field.name: getattr(options, field.name, None) for field in fields(ExportOptions)
    }
    given["region"] = None if options.region is None else parse_region(options.region)
    about = write(
        options.out,
        options.file,
        options=ExportOptions(**given),
        stage=options.stage,
        report=lambda line: console.print(f"export: {line}", markup=False),
    )
    print_unless_json(options, f"wrote {options.file}: {about}")
    return Answer(
        {"out": str(options.shown), "file": str(options.file), "lines": about.split("\n")}
    )


def publish(options: argparse.Namespace) -> Answer:
    """Put the bundle on a web host."""
    from stereocell.engine.run import console
    from stereocell.publish.publish import publish as put
    from stereocell.serve.lan import draw_qr
    from stereocell.storage.location import Location

    done = put(
        options.out,
        options.target,
        options.url,
        is_public=not options.private,
        report=lambda line: console.print(f"publish: {line}", markup=False),
    )
    shown = Location.of(options.target).shown
    print_unless_json(
        options,
        f"{shown}: {done.files} files, {done.bytes:,} bytes: {done.uploaded} uploaded "
        f"({done.uploaded_bytes:,} bytes), {done.removed} removed",
    )
    if done.address is not None:
        if done.address.startswith("https://") and not options.json:
            print_line(draw_qr(done.address, encoding=sys.stdout.encoding or "utf-8"))
        print_unless_json(options, f"look at it: {done.address}")
    return Answer({"out": str(options.shown), "target": shown, **asdict(done)})


def doctor(options: argparse.Namespace) -> Answer:
    """Examine this machine. The exit code is 1 if a required part is missing."""
    from stereocell.cli.doctor import examine

    found = []
    for one in examine():
        found.append(one)
        mark = "ok     " if one.ok else "missing" if one.is_needed else "without"
        print_unless_json(
            options, f"{mark} {one.name}: {one.found}" + (f": {one.cost}" if one.cost else "")
        )
    can_work = all(one.ok for one in found if one.is_needed)
    return Answer({"ok": can_work, "found": [asdict(one) for one in found]}, 0 if can_work else 1)


def view(options: argparse.Namespace) -> Answer:
    """Serve a bundle and open it in a browser."""
    # With --lan every browser needs the code that the terminal shows, so none is opened here.
    return _serve(options, not (options.no_browser or options.lan))


def serve(options: argparse.Namespace) -> Answer:
    """Serve a bundle."""
    return _serve(options, False)


def _serve(options: argparse.Namespace, open_browser: bool) -> Answer:
    def run(folder: Path, live: "Live | None" = None) -> None:
        from stereocell.serve.server import serve  # imported while the source is read

        serve(
            folder,
            options.port,
            lan=options.lan,
            open_browser=open_browser,
            for_program=options.json,
            frames=tuple(options.allow_frame),
            live=live,
        )

    try:
        if options.is_source:
            options.input = str(options.out)
            if listed := _series(options):
                return listed
            _show_source(options, run)
        else:
            _require_no_source_flags(options)
            run(options.out)
    except BrokenPipeError as error:  # the program that reads the address has ended
        raise StdoutLost(error) from error
    return Answer()


def is_inbox(options: argparse.Namespace) -> bool:
    """Return whether an inbox is served.

    Raises UsageError unless the command names one of OUT, a source and an inbox.
    """
    if options.inbox is None:
        if options.out is None:
            raise UsageError(
                f"`stereocell {options.command}` has nothing to show, expected a build, a volume "
                "or --inbox FOLDER"
            )
        if options.inbox_gb is not None:
            raise UsageError("--inbox-gb is given without --inbox FOLDER, expected both")
        return False
    if options.out is not None:
        raise UsageError(f"--inbox and {options.out} are both given, expected one of them")
    given = _source_flags(options)
    if given or options.allow_frame:
        first = [*given, "--allow-frame"][0]
        raise UsageError(
            f"{first} does not apply to an inbox, whose users choose in the page: leave it out"
        )
    return True


def serve_inbox(options: argparse.Namespace) -> Answer:
    """Serve an inbox."""
    from stereocell.cli.inbox_build import make_inbox_build
    from stereocell.inbox.limits import UPLOAD_BYTES, InboxLimits
    from stereocell.serve.inbox_server import serve_inbox as run

    gb = options.inbox_gb
    limits = InboxLimits(bytes=UPLOAD_BYTES if gb is None else round(gb * 1e9))
    may_open = options.command == "view" and not (options.no_browser or options.lan)
    try:
        run(
            options.inbox,
            limits,
            make_inbox_build,
            port=options.port,
            lan=options.lan,
            open_browser=may_open,
            for_program=options.json,
        )
    except BrokenPipeError as error:  # the program that reads the address has ended
        raise StdoutLost(error) from error
    return Answer()


def _source_flags(options: argparse.Namespace) -> list[str]:
    """Return the given flags that apply to a source alone, not to a build."""
    given = given_flags(options)
    if options.no_build:
        given.append("--no-build")
    if options.build_out is not None:
        given.append("--out")
    if options.title:
        given.append("--title")
    return given


def _require_no_source_flags(options: argparse.Namespace) -> None:
    """Raise UsageError if a flag for sources is given with a build."""
    if given := _source_flags(options):
        raise UsageError(
            f"{given[0]} sets how a volume is read, but {options.shown} is a build: leave it out, "
            "or name the volume"
        )


def _show_source(options: argparse.Namespace, run: "Callable[[Path, Live | None], None]") -> None:
    """Serve the first view of a source, and build the source meanwhile."""
    source = str(options.out)
    _require_found(source)
    from stereocell.cli.build_behind import build_behind
    from stereocell.live.show_source import Behind, show_source
    from stereocell.planning.preset_choice import load_for

    wanted, choice = load_for(source, options.preset, options.config, flags=flags_of(options))

    def serve_live(live: "Live") -> None:
        run(live.bundle, live)

    behind = None
    if not options.no_build:
        behind = Behind(
            build_behind(options, build), options.build_out, lambda bundle: run(bundle, None)
        )
    show_source(source, wanted, choice, serve_live, behind, title=options.title or "")
