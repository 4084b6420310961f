"""Show a source that is not built: `stereocell view INPUT`."""

import re
import shlex
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from stereocell.building.out_folder import require_build_or_nothing
from stereocell.engine.run import Watch, console
from stereocell.live.build_process import BuildProcess
from stereocell.live.first_view import read_channels, write_first_view
from stereocell.live.partial_view import PartialView
from stereocell.model.errors import OutputError
from stereocell.planning.input_files import as_asked
from stereocell.planning.plan import Plan
from stereocell.planning.plan_notes import print_notes
from stereocell.planning.settings import Settings
from stereocell.planning.settle import settle
from stereocell.read.image import printable
from stereocell.read.known_formats import find_format
from stereocell.steps.open_source import open_source
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
    if str(place).startswith(("http://", "https://")):
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


Serve = Callable[[Path, BuildProcess | None, int], None]


def show_source(
    source: str, settings: Settings, choice: Sequence[str], serve: Serve, behind: Behind | None
) -> None:
    """Write the first view of a source into a folder of its own, and serve it until that returns.

    choice  notes on how the settings were chosen; see `load_for`
    serve   serves a folder with a bundle, the build behind it, and its number of tiles
    behind  how the source is built meanwhile; None: it is only looked at

    Raises StereoCellError where the source can't be read. The folder is removed at the end.
    """
    began_s = time.monotonic()
    viewer = viewer_dist()
    if viewer is None:
        raise OutputError("the viewer is not built: run `make setup`")
    plan = settle(source, settings, choice)
    dataset = open_source(as_asked(plan.source, plan.settings.plan))
    with tempfile.TemporaryDirectory(prefix="stereocell-") as folder:
        scratch = Path(folder)
        root = scratch / "bundle"
        root.mkdir()
        read = read_channels(plan, dataset)
        write_first_view(plan, read, root, viewer)
        seconds = time.monotonic() - began_s
        build, so = None, f"For surfaces: stereocell build {shlex.quote(source)} -o OUT"
        if behind is None:
            print_notes(plan)  # a build prints them itself
        else:
            out = default_out(plan) if behind.out is None else behind.out
            require_build_or_nothing(out, source)
            view = PartialView(plan, read, out, scratch)
            build = BuildProcess(partial(behind.build, out), view, out)
            so = f"It is built behind the page, into {printable(str(out))} (--no-build: only shown)"
        console.print(
            f"first view: {printable(plan.name)} after {seconds:.1f} s, by coarse volumes. {so}",
            markup=False,
            soft_wrap=True,
        )
        serve(root, build, len(plan.tiles))


def default_out(plan: Plan) -> Path:
    """Return the folder in the working folder into which a specimen is built without `--out`."""
    name = re.sub(r"[^\w.+-]+", "_", plan.name).strip("._") or "specimen"
    return Path(f"{name}.stereocell")
