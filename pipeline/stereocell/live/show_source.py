"""Show a source that is not built: `stereocell view INPUT`."""

import shlex
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from stereocell.engine.run import console
from stereocell.live.first_view import write_first_view
from stereocell.model.errors import OutputError
from stereocell.planning.input_files import as_asked
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


def show_source(
    source: str, settings: Settings, choice: Sequence[str], serve: Callable[[Path], None]
) -> None:
    """Write the first view of a source into a folder of its own, and serve it until that returns.

    choice  notes on how the settings were chosen; see `load_for`
    serve   serves a folder with a bundle

    Raises StereoCellError where the source can't be read. The folder is removed at the end.
    """
    began_s = time.monotonic()
    viewer = viewer_dist()
    if viewer is None:
        raise OutputError("the viewer is not built: run `make setup`")
    plan = settle(source, settings, choice)
    dataset = open_source(as_asked(plan.source, plan.settings.plan))
    with tempfile.TemporaryDirectory(prefix="stereocell-") as folder:
        root = Path(folder) / "bundle"
        root.mkdir()
        write_first_view(plan, dataset, root, viewer)
        print_notes(plan)
        seconds = time.monotonic() - began_s
        console.print(
            f"first view: {printable(plan.name)} after {seconds:.1f} s, by coarse volumes. For "
            f"surfaces and all voxels: stereocell build {shlex.quote(source)} -o OUT",
            markup=False,
            soft_wrap=True,
        )
        serve(root)
