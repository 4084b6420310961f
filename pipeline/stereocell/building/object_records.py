"""Keep notes on a label map's objects in OUT, and make the table of the objects from them."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

from pydantic import TypeAdapter

from stereocell.building.out_folder import OutFolder
from stereocell.model.object_notes import ObjectNotes
from stereocell.model.object_table import ObjectTable
from stereocell.planning.located_objects import (
    Located,
)
from stereocell.planning.object_tables import make_table, table_of
from stereocell.planning.plan import Plan
from stereocell.read.known_formats import format_of
from stereocell.steps.labels import Labels
from stereocell.steps.unit_files import load_objects
from stereocell.steps.units_again import AGAIN
from stereocell.storage.json_files import find_sealed, read_sealed, write_sealed
from stereocell.storage.location import Location

NOTES = "units.schema.json#Notes"


def save_notes(out_folder: OutFolder, plan: Plan, labels: Labels) -> None:
    """Write the names and columns of objects in a label map's file to OUT.

    The stage needs them and is made without that file. Raises SourceError if the file can't be
    read.
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
    """Return the notes that `save_notes` wrote. Raises OutputError."""
    file = _notes_file(out_folder, plan, labels)
    return _notes().validate_python(read_sealed(file, NOTES, AGAIN)["notes"])


def _notes_file(out_folder: OutFolder, plan: Plan, labels: Labels) -> Path:
    is_free = _free_labels_reader(plan, labels) is not None
    kind = f"{labels.id}-free" if is_free else labels.id
    return out_folder.notes_file(kind, labels.ref.fingerprint)


def _free_labels_reader(plan: Plan, labels: Labels) -> Callable[[Location], dict[int, str]] | None:
    """Return the function that reads the segments' free-text names; None: they are not used."""
    wanted = plan.settings.objects.segment_labels
    return format_of(labels.ref.source).read_free_labels if wanted else None


@cache
def _notes() -> TypeAdapter[ObjectNotes]:
    return TypeAdapter(ObjectNotes)


def table_of_objects(
    out_folder: OutFolder, plan: Plan, labels: Labels, located: Located
) -> tuple[ObjectTable, list[str]]:
    """Return the table of a label map's objects, and remarks for the user."""
    index = out_folder.index()
    names = {tile.id: f"{tile.id}/{labels.id}" for tile in plan.tiles}
    facts = {
        tile: load_objects(out_folder.unit_dir(name, index[name])) for tile, name in names.items()
    }
    notes = read_notes(out_folder, plan, labels)
    return make_table(plan, labels, located, facts, notes, table_of(plan, labels))
