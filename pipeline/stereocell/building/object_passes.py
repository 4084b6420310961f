"""The passes over label maps: first where the objects are, then the units that build them."""

from dataclasses import replace
from functools import cache
from pathlib import Path

from pydantic import TypeAdapter

from stereocell.building.out_folder import OutFolder
from stereocell.building.run_on_input import run_pass
from stereocell.engine.run import Engine, console
from stereocell.engine.run_steps import Kept
from stereocell.model.object_notes import ObjectNotes
from stereocell.planning.label_numbers import is_large, notes_on_numbers, told_of
from stereocell.planning.located_objects import (
    Located,
    TileGrid,
    locate,
    tile_boxes,
)
from stereocell.planning.plan import Plan
from stereocell.steps.find_extents import FindExtents
from stereocell.steps.labels import Labels
from stereocell.steps.units_again import AGAIN
from stereocell.storage.json_files import find_sealed, read_sealed, write_sealed
from stereocell.storage.location import Location

NOTES = "units.schema.json#Notes"


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
    if _has_free_names(plan, labels):
        # pydicom takes a third of a second to import: every command and worker would wait for it
        from stereocell.read.dicom import read_free_labels

        own = read_free_labels(Location.of(labels.ref.source))
        notes = replace(notes, names=notes.names | own)
    write_sealed(file, {"notes": _notes().dump_python(notes, mode="json")})


def read_notes(out_folder: OutFolder, plan: Plan, labels: Labels) -> ObjectNotes:
    """Return what `save_notes` kept. Raises OutputError."""
    file = _notes_file(out_folder, plan, labels)
    return _notes().validate_python(read_sealed(file, NOTES, AGAIN)["notes"])


def _notes_file(out_folder: OutFolder, plan: Plan, labels: Labels) -> Path:
    kind = f"{labels.id}-free" if _has_free_names(plan, labels) else labels.id
    return out_folder.notes_file(kind, labels.ref.fingerprint)


def _has_free_names(plan: Plan, labels: Labels) -> bool:
    """Return whether segments are called by what somebody wrote."""
    is_dicom = Location.of(labels.ref.source).format == "dicom"
    return plan.settings.objects.segment_labels and is_dicom


@cache
def _notes() -> TypeAdapter[ObjectNotes]:
    return TypeAdapter(ObjectNotes)


def tell_objects(labels: Labels, located: Located) -> None:
    """Print the number of objects, and the notes on their numbers if `plan` did not count them."""
    notes = notes_on_numbers(labels, located) if is_large(labels) else ()
    for note in (told_of(labels, located), *notes):
        console.print(f"units: {note}", markup=False, soft_wrap=True)
