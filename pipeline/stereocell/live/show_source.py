"""Show a source that is not built: `stereocell view INPUT`."""

import shlex
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from stereocell.engine.run import Watch, console
from stereocell.live.build_place import finished_bundle, free_place, require_place
from stereocell.live.build_process import BuildProcess, Coarse
from stereocell.live.build_state import WatchedBuild
from stereocell.live.fine_tiles import FineTiles, ReadFine
from stereocell.live.first_look import FirstLook
from stereocell.live.reading import Reading
from stereocell.model.errors import OutputError
from stereocell.planning.plan_notes import print_notes
from stereocell.planning.settings import Settings
from stereocell.read.image import printable
from stereocell.storage.assets import viewer_dist
from stereocell.storage.location import Location


@dataclass(frozen=True, slots=True)
class Behind:
    """The build that runs while the first view of a source is shown.

    build         builds into a folder; see `build_process.Build`
    out           the folder; None for one in the working folder, named after the specimen
    serve_bundle  serves the bundle of a build that finished earlier, until the user stops it
    """

    build: Callable[[Path, Watch], str]
    out: Path | None
    serve_bundle: Callable[[Path], None]


@dataclass(frozen=True, slots=True)
class Live:
    """A source that is shown.

    page     the folder of the viewer
    bundle   the folder of the first view; complete once `first` has a result
    first    done once the first view is written; holds the error if it can't be written
    fine     reads the tiles that the camera sees at full resolution; None if views stay coarse
    build    the build that runs meanwhile; None if the source is only shown
    reading  the share that has been read for the first view
    """

    page: Path
    bundle: Path
    first: Future[None]
    fine: ReadFine | None
    build: WatchedBuild | None
    reading: Reading


def show_source(
    source: str,
    settings: Settings,
    choice: Sequence[str],
    serve: Callable[[Live], None],
    behind: Behind | None,
    *,
    title: str = "",
) -> None:
    """Serve a source: its first view, which is written meanwhile, and then the views of its build.

    If a build of the source finished earlier, its bundle is served instead.

    choice  notes on how the settings were chosen; see `load_for`
    serve   serves until the user stops it, or until the first view turns out to be impossible
    behind  the build that runs meanwhile; None to show the source only
    title   the name of the specimen; empty for the name in the source

    Raises StereoCellError if the source can't be read. The views are removed at the end.
    """
    began_s = time.monotonic()
    page = viewer_dist()
    if page is None:
        raise OutputError("the viewer is not built: run `make setup`")
    if not Location.of(source).is_local:
        _print(f"reading {printable(source)}")  # a remote source may take a while to answer
    look = FirstLook.at(source, settings, choice, title=title)
    plan = look.plan
    fine = FineTiles(plan, look.dataset)
    build = None
    if behind is not None:
        out = free_place(plan) if behind.out is None else behind.out
        require_place(source, out, plan)
        if (bundle := finished_bundle(out, plan)) is not None:
            _print(
                f"showing the finished build in {printable(str(out))}; to check it, run "
                f"`stereocell build {shlex.quote(source)} -o {shlex.quote(str(out))}`"
            )
            behind.serve_bundle(bundle)
            return
        build = BuildProcess(partial(behind.build, out), out, partial(_explain_stop, fine))
    else:
        print_notes(plan)  # a build would print the notes itself
    with tempfile.TemporaryDirectory(prefix="stereocell-", ignore_cleanup_errors=True) as folder:
        scratch, first = Path(folder), Future[None]()
        live = Live(page, scratch / "bundle", first, fine, build, Reading(_print))

        def write() -> None:
            try:
                read = look.read(live.reading.add)
                sizes = fine.sizes()
                look.write(live.bundle, sizes)
            except BaseException as error:  # the command raises it again from `first`
                first.set_exception(error)
                return
            first.set_result(None)
            seconds = time.monotonic() - began_s
            _print(f"first view of {printable(plan.name)} after {seconds:.1f} s: coarse volumes")
            if build is None:
                _print(f"for surfaces, run `stereocell build {shlex.quote(source)} -o OUT`")
            else:
                _print(
                    f"building surfaces into {printable(str(build.out))}; use --no-build to only "
                    "show the source"
                )
                build.start(Coarse(plan, read, build.out, scratch, sizes))

        threading.Thread(target=write, daemon=True).start()
        try:
            serve(live)
        finally:
            if build is not None:
                build.close()
        if first.done():
            first.result()


def _explain_stop(fine: FineTiles, line: str) -> str:
    """Print and return the reason why a build stopped: a changed source, or the error's line."""
    reason = fine.change() or line
    _print(f"the build has stopped: {reason}")
    return reason


def _print(line: str) -> None:
    console.print(line, markup=False, soft_wrap=True)
