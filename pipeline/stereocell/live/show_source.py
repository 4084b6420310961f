"""Show a source that is not built: `stereocell view INPUT`."""

import re
import shlex
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from stereocell.building.out_folder import require_build_or_nothing
from stereocell.engine.run import Watch, console
from stereocell.live.build_process import BuildProcess, Coarse
from stereocell.live.build_state import WatchedBuild
from stereocell.live.fine_tiles import FineTiles
from stereocell.live.first_look import FirstLook
from stereocell.live.reading import Reading
from stereocell.model.errors import OutputError
from stereocell.planning.plan import Plan
from stereocell.planning.plan_notes import print_notes
from stereocell.planning.settings import Settings
from stereocell.read.addresses.resolve import may_know
from stereocell.read.image import printable
from stereocell.read.known_formats import find_format
from stereocell.storage.assets import viewer_dist
from stereocell.storage.contents import contents_of
from stereocell.storage.kinds import Kind
from stereocell.storage.location import Location


def is_source(place: Path | str) -> bool:
    """Return whether a place is a source, and neither a build nor a bundle.

    A path that does not exist counts as a source if its name ends as those of a format do: then the
    reader reports that it is missing.
    """
    if isinstance(place, Path) and place.exists():
        return contents_of(place).kind in (Kind.FILE, Kind.FOLDER)
    if may_know(place):
        return True
    return find_format(Location.of(place)) is not None


@dataclass(frozen=True, slots=True)
class Behind:
    """The build behind the first view of a source.

    build  builds into a folder; see `build_process.Build`
    out    the folder; None: one in the working folder that is named after the source
    """

    build: Callable[[Path, Watch], str]
    out: Path | None


@dataclass(frozen=True, slots=True)
class Live:
    """A source that is shown.

    page     the folder of the viewer
    bundle   the folder of the first view, once `first` has a result
    first    done once the first view is written; its error is why that can't be
    fine     the tiles that are looked at, read from the source; None: the views stay coarse
    build    the build behind the view; None: it is only looked at
    reading  how much has been read for the first view
    """

    page: Path
    bundle: Path
    first: Future[None]
    fine: FineTiles | None
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
    """Serve a source: its first view, which is written meanwhile, and then what is built of it.

    choice  notes on how the settings were chosen; see `load_for`
    serve   serves until it is stopped, or until there can be no first view
    behind  how the source is built meanwhile; None: it is only looked at
    title   the name of the specimen; empty: the one that the source gives it

    Raises StereoCellError where the source can't be read. The views are removed at the end.
    """
    began_s = time.monotonic()
    page = viewer_dist()
    if page is None:
        raise OutputError("the viewer is not built: run `make setup`")
    if not Location.of(source).is_local:
        _print(f"reading {printable(source)}")  # an answer may take a while
    look = FirstLook.at(source, settings, choice, title=title)
    plan = look.plan
    build = None
    if behind is not None:
        out = default_out(plan) if behind.out is None else behind.out
        require_build_or_nothing(out, source)
        build = BuildProcess(partial(behind.build, out), out)
    else:
        print_notes(plan)  # a build prints them itself
    with tempfile.TemporaryDirectory(prefix="stereocell-", ignore_cleanup_errors=True) as folder:
        scratch, first = Path(folder), Future[None]()
        fine = FineTiles(plan, look.dataset)
        live = Live(page, scratch / "bundle", first, fine, build, Reading(_print))

        def write() -> None:
            try:
                read = look.read(live.reading.add)
                sizes = fine.sizes()
                look.write(live.bundle, sizes)
            except BaseException as error:  # the command raises it
                first.set_exception(error)
                return
            first.set_result(None)
            seconds = time.monotonic() - began_s
            _print(f"first view: {printable(plan.name)} after {seconds:.1f} s, by coarse volumes")
            if build is None:
                _print(f"for surfaces: stereocell build {shlex.quote(source)} -o OUT")
            else:
                _print(
                    f"built behind the page into {printable(str(build.out))}; --no-build only shows"
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


def _print(line: str) -> None:
    console.print(line, markup=False, soft_wrap=True)


def default_out(plan: Plan) -> Path:
    """Return the folder in the working folder into which a specimen is built without `--out`."""
    name = re.sub(r"[^\w.+-]+", "_", plan.name).strip("._") or "specimen"
    return Path(f"{name}.stereocell")
