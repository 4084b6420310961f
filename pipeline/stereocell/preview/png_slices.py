"""Write one channel as 8-bit PNG slices, with a JSON file that describes them.

    000.png 001.png ...     slices across one axis, the right way up (preview/cut_planes.py)
    slices.json             plane, sizes, positions, window, modality (schemas/slices.schema.json)

The window is found as in a build, so that 0 and 255 mean the same as there.
"""

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from stereocell.isosurface.options import SurfaceOptions
from stereocell.model.errors import UsageError
from stereocell.model.version import GENERATOR
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import source_of
from stereocell.planning.settings import Settings
from stereocell.planning.survey_steps import window_step
from stereocell.preview.cut_planes import (
    ACQUIRED,
    Cut,
    choose_view,
    cut_planes,
    extent_words,
    is_patient,
)
from stereocell.preview.views import views_of
from stereocell.steps.open_source import open_source
from stereocell.storage.atomic_write import replacing_folder
from stereocell.storage.contents import contents_of, is_ignored, words_for
from stereocell.storage.folder_names import names_in_folder
from stereocell.storage.json_files import find_json, write_json
from stereocell.storage.kinds import Kind
from stereocell.storage.overwriting import require_free

INDEX = "slices.json"
_EXPECTED = "nothing or slices of the same source"
FORMAT, VERSION = "stereocell-slices", 2


@dataclass(frozen=True, slots=True)
class Written:
    """The number of slices that were written, the plane's name, and a line that describes them."""

    count: int
    plane: str
    line: str


def without_surface(settings: Settings) -> Settings:
    """Return settings with all lengths of surfaces 0, so that they suit voxels of any size."""
    lengths = {f.name: 0.0 for f in fields(SurfaceOptions) if f.name.endswith("_um")}
    return replace(settings, surface=SurfaceOptions(**lengths))  # type: ignore[arg-type]


def write_slices(plan: Plan, folder: Path, *, plane: str = ACQUIRED) -> Written:
    """Write the plan's only channel, in the plan's region.

    folder  folder for the slices; replaced as a whole if it holds slices
    plane   one of cut_planes.PLANES

    Raises UsageError for more than one channel or a plane that the source lacks, OutputError for a
    folder with other content, SourceError if the source can't be read.
    """
    dataset, channel = open_source(source_of(plan)), plan.channels[0]
    views = views_of(plan.placement, is_neurological=plan.settings.plan.neurological)
    choose_view(views, dataset.acquired.axis, plane, dataset.shown)  # report a wrong plane first
    if len(plan.channels) != 1:
        found = ", ".join(channel.name for channel in plan.channels)
        raise UsageError(f"slices: found channels {found}, expected one: choose it by --channels")
    _require_own(folder, plan)
    cut = cut_planes(dataset, plan, channel.index, plane)
    window = window_step(plan, channel).run().statistics.window
    count = len(cut.first_um)
    names = [f"{k:0{len(str(count))}d}.png" for k in range(count)]
    with replacing_folder(folder) as new:
        for name, picture in zip(names, cut.planes, strict=True):
            Image.fromarray(to_bytes(picture, window)).save(new / name)
        content = _describe(plan, cut, window, names)
        write_json(new / INDEX, content)
    return Written(count, cut.view.name, _line(plan, cut))


def to_bytes(plane: NDArray[Any], window: tuple[float, float]) -> NDArray[np.uint8]:
    """Return grey values as uint8 of the same shape; the window becomes 0..255."""
    low, high = window
    share = (plane.astype(np.float32) - np.float32(low)) / np.float32(high - low)
    return np.rint(255 * np.clip(share, 0, 1)).astype(np.uint8)


def _describe(
    plan: Plan, cut: Cut, window: tuple[float, float], names: list[str]
) -> dict[str, object]:
    down, right = cut.steps_um.tolist()
    places = zip(names, cut.first_um.tolist(), strict=True)
    return {
        "format": FORMAT,
        "version": VERSION,
        "generator": GENERATOR,
        "fingerprint": plan.fingerprint,
        "modality": plan.modality,
        "plane": cut.view.name,
        "shape": [len(names), *cut.shape],
        "pixel_um": list(cut.pixel_um),
        "window": list(window),
        "axes_grow_to": extent_words(cut, is_patient=is_patient(plan)),
        "step_down_um": down,
        "step_right_um": right,
        "slices": [{"file": name, "first_um": first} for name, first in places],
    }


def _line(plan: Plan, cut: Cut) -> str:
    """Return a line that describes the slices: `28 axial slices, 512 x 512 pixels of ...`."""
    (rows, columns), size, count = cut.shape, max(cut.pixel_um), len(cut.first_um)
    words = extent_words(cut, is_patient=is_patient(plan))
    if is_patient(plan):
        left, right, top, bottom = cut.view.ends
        pixel, runs = f"{size / 1000:.3g} mm", f"towards {words['slices']}"
        sides = f"{left} on the left, {right} on the right, {top} above, {bottom} below"
    else:
        pixel, runs = f"{size:.3g} um", f"along {words['slices']}"
        sides = f"{words['columns']} to the right, {words['rows']} down"
    own = ", the source's own images" if cut.are_own else ""
    return (
        f"{count} {cut.view.name} slice{'s' * (count != 1)}{own}, {columns} x {rows} pixels of "
        f"{pixel}, {runs}; {sides}"
    )


def require_slices_or_nothing(folder: Path) -> None:
    """Raise OutputError if a folder holds anything but slices, of any source."""
    require_free(folder, expected=_EXPECTED, is_ours=contents_of(folder).kind is Kind.SLICES)


def _require_own(folder: Path, plan: Plan) -> None:
    """Raise OutputError unless a folder is empty, or holds only slices of the same source."""
    found = contents_of(folder)
    names = {name for name in names_in_folder(folder) if not is_ignored(name)}
    is_ours = found.kind is Kind.SLICES and found.fingerprint == plan.fingerprint
    if is_ours and (others := sorted(names - {INDEX, *_listed(folder)})):
        require_free(folder, expected="slices and no other file", found=words_for(others))
    require_free(folder, expected=_EXPECTED, is_ours=is_ours)


def _listed(folder: Path) -> set[str]:
    """Return the names of the slices that the index in a folder lists."""
    content = find_json(folder / INDEX, "slices.schema.json")
    return {one["file"] for one in content["slices"]} if content else set()
