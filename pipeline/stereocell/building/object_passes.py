"""The passes over label maps: first where the objects are, then the units that build them."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from stereocell.building.label_maps import Labels
from stereocell.building.label_numbers import notes_on_numbers
from stereocell.building.located_objects import (
    AROUND,
    CUT,
    Located,
    TileGrid,
    locate,
    tile_boxes,
)
from stereocell.building.out_folder import OutFolder
from stereocell.building.plan import Plan
from stereocell.building.plan_source import voxels_of
from stereocell.building.run_on_input import run_pass
from stereocell.building.steps.build_objects import BuildObjects, Image, Painted
from stereocell.building.steps.find_extents import FindExtents
from stereocell.building.survey_file import Survey
from stereocell.building.units_again import AGAIN
from stereocell.engine.run import Engine, console
from stereocell.engine.run_steps import Kept
from stereocell.formats.gltf import choose_step
from stereocell.model.counted import counted
from stereocell.model.object_notes import ObjectNotes
from stereocell.model.tiling import Tile
from stereocell.objects.options import ObjectOptions
from stereocell.read.known_formats import format_of
from stereocell.storage.json_files import find_sealed, read_sealed, write_sealed
from stereocell.storage.location import Location

NOTES = "units.schema.json#Notes"
_NO_EDGES = (np.zeros(0, np.int64),) * 3  # of tiles, where nothing is cut
_UM = 1e6  # um a metre
_COUNTED_AT_ONCE = 1 << 25  # voxels of a label map that `plan` counts: half a second


def locate_objects(out_folder: OutFolder, plan: Plan, labels: Labels, engine: Engine) -> Located:
    """Return which tile builds which object of a label map; a tile that was searched stays so.

    Raises SourceError where a label map can't be read.
    """
    kept = {}
    for tile, box in tile_boxes(TileGrid.of(plan, labels)).items():
        step = FindExtents(labels.voxels, box)
        place = out_folder.tile_result("extents", tile, labels.id, step.key)
        kept[tile] = Kept(f"{tile}/{labels.name}", step, place)
    run_pass(out_folder, plan, engine, "objects", kept.values())
    parts = {tile: one.read() for tile, one in kept.items()}
    return locate(plan, labels, parts, plan.settings.objects.smallest_voxels)


def save_notes(out_folder: OutFolder, plan: Plan, labels: Labels) -> None:
    """Keep what a label map's file says of its objects: the stage is made without that file.

    Raises SourceError.
    """
    file = _notes_file(out_folder, plan, labels)
    if find_sealed(file, NOTES) is not None:
        return
    notes = labels.open().notes
    if (read_free_labels := _free_labels_reader(plan, labels)) is not None:
        own = read_free_labels(Location.of(labels.ref.source))
        notes = replace(notes, names=notes.names | own)
    write_sealed(file, {"notes": _notes().dump_python(notes, mode="json")})


def read_notes(out_folder: OutFolder, plan: Plan, labels: Labels) -> ObjectNotes:
    """Return what `save_notes` kept. Raises OutputError."""
    file = _notes_file(out_folder, plan, labels)
    return _notes().validate_python(read_sealed(file, NOTES, AGAIN)["notes"])


def _notes_file(out_folder: OutFolder, plan: Plan, labels: Labels) -> Path:
    is_free = _free_labels_reader(plan, labels) is not None
    kind = f"{labels.id}-free" if is_free else labels.id
    return out_folder.notes_file(kind, labels.ref.fingerprint)


def _free_labels_reader(plan: Plan, labels: Labels) -> Callable[[Location], dict[int, str]] | None:
    """Return the function that reads the segments' free names; None: they are not used."""
    wanted = plan.settings.objects.segment_labels
    return format_of(labels.ref.source).read_free_labels if wanted else None


@cache
def _notes() -> TypeAdapter[ObjectNotes]:
    return TypeAdapter(ObjectNotes)


def tell_objects(labels: Labels, located: Located) -> None:
    """Print the number of objects, and the notes on their numbers if `plan` did not count them."""
    notes = notes_on_numbers(labels, located) if _is_large(labels) else ()
    for note in (told_of(labels, located), *notes):
        console.print(f"units: {note}", markup=False, soft_wrap=True)


def told_of(labels: Labels, located: Located) -> str:
    """Return how many objects there are, which are cut, and how many are left out, in words."""
    summary = counted(len(located.owners), "object")
    cut = located.extents.labels[located.owners == CUT]
    if len(cut):
        shown = ", ".join(map(str, cut[:8].tolist())) + ", ..." * (len(cut) > 8)
        summary += f", {len(cut)} of them larger than a tile and half around it, and cut ({shown})"
    if located.small:
        summary += f"; {located.small} of too few voxels are left out (objects.smallest_voxels)"
    return f"{labels.name}: {summary}"


def _is_large(labels: Labels) -> bool:
    """Return whether a label map has too many voxels for `plan` to count its objects."""
    return math.prod(labels.shape) > _COUNTED_AT_ONCE


def told_before(plan: Plan) -> Iterator[str]:
    """Yield of each label map what its units will cut, from its voxels where these are few.

    Raises SourceError where they are no labels.
    """
    for labels in plan.labels:
        boxes = tile_boxes(TileGrid.of(plan, labels))
        if not _is_large(labels):
            parts = {tile: FindExtents(labels.voxels, box).run() for tile, box in boxes.items()}
            found = locate(plan, labels, parts, plan.settings.objects.smallest_voxels)
            yield told_of(labels, found)
            yield from notes_on_numbers(labels, found)
        elif len(plan.tiles) > 1:
            largest = np.max([box.shape for box in boxes.values()], axis=0) * labels.spacing_um
            z, y, x = ((1 + 2 * AROUND) * largest).tolist()
            yield (
                f"{labels.name}: objects larger than a tile and half around it, {z:.4g} x {y:.4g} "
                f"x {x:.4g} um (z, y, x), will be cut at the tiles' planes: `units` names them"
            )


def object_steps(
    plan: Plan, located: Mapping[str, Located], survey: Survey
) -> dict[str, BuildObjects]:
    """Return the step of the unit of each tile and label map, by `<tile>/<labels>`."""
    images = images_of(plan)
    step_um = lattice_step_um(plan, located)
    steps = {}
    for labels in plan.labels:
        found, painted = located[labels.id], _painted(plan, labels, survey)
        boxes = tile_boxes(found.grid)
        for tile in plan.tiles:
            parts = _parts(found, tile)
            is_cut = len(parts["cut"]) or len(parts["others_cut"])
            steps[f"{tile.id}/{labels.id}"] = BuildObjects(
                labels,
                found.window(tile.id),
                boxes[tile.id],
                **parts,
                edges=found.grid.edges if is_cut else _NO_EDGES,
                step_um=step_um,
                images=images,
                painted=painted,
                options=_of_units(plan.settings.objects),
            )
    return steps


def _parts(found: Located, tile: Tile) -> dict[str, NDArray[np.uint64]]:
    """Return the labels in a tile's window by how they are built; see `BuildObjects`."""
    window, numbers = found.window(tile.id), found.owned(tile.id)
    near = np.zeros(0, np.int64) if window is None else found.near(window)
    is_cut, names = found.owners == CUT, found.extents.labels
    others = np.setdiff1d(near, numbers)
    return {
        "whole": names[numbers[~is_cut[numbers]]],
        "cut": names[numbers[is_cut[numbers]]],
        "others": names[others],
        "others_cut": names[others[is_cut[others]]],
    }


def _of_units(options: ObjectOptions) -> ObjectOptions:
    """Return the options that units depend on; those of tables and names have their defaults."""
    plain = ObjectOptions()
    names = ("table", "table_key", "columns", "color_by", "segment_labels", "background")
    return replace(options, **{name: getattr(plain, name) for name in names})


def lattice_step_um(plan: Plan, located: Mapping[str, Located]) -> float:
    """Return the step of the lattice that objects' vertices lie on, um.

    It is the bundle's, or a multiple of it: a power of two of metres, of tiles as large as they may
    become. So that what is checked is what is written.
    """
    longest = 0.0
    for tile in plan.tiles:
        spacing = np.asarray(plan.spacing_um)
        low = np.array(plan.position_um(tile.box.start)) - spacing
        high = np.array(plan.position_um(tile.box.stop)) + spacing
        for labels in plan.labels:
            window = located[labels.id].window(tile.id)
            if window is not None:
                low = np.minimum(low, labels.position_um(window.start))
                high = np.maximum(high, labels.position_um(window.stop))
        longest = max(longest, float((high - low).max()))
    return choose_step(longest) * _UM


def images_of(plan: Plan) -> tuple[Image, ...]:
    """Return the image's channels, as they are built."""
    seen, found = set(), []
    for channel in plan.channels:
        if channel.voxels_id in seen:
            continue
        seen.add(channel.voxels_id)
        found.append(Image(voxels_of(plan, channel), plan.region))
    return tuple(found)


def _painted(plan: Plan, labels: Labels, survey: Survey) -> Painted | None:
    """Return what is painted on the objects of a label map; None: nothing."""
    painter = plan.painter(labels)
    if painter is None:
        return None
    window = survey[painter.id].statistics.window
    image = Image(voxels_of(plan, painter), plan.region)
    return Painted(image, window, float(plan.settings.unwrap.paint_um))
