"""Make the table of a label map's objects from its units, its file and the user's table."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from stereocell.model.channel import DEFAULT_FUNCTION, Appearance
from stereocell.model.counted import counted
from stereocell.model.errors import UsageError
from stereocell.model.identifiers import to_identifier
from stereocell.model.object_notes import ObjectNotes
from stereocell.model.object_table import Column, ObjectTable
from stereocell.model.unit import ObjectFacts
from stereocell.model.volume import zyx_to_xyz
from stereocell.objects.table import (
    Place,
    category_column,
    number_column,
    own_columns,
)
from stereocell.planning.located_objects import CUT, Located
from stereocell.planning.plan import Plan
from stereocell.planning.stopped_levels import notes_on_stopped_levels
from stereocell.read.tables import Table, read_table
from stereocell.read.tables.table import TableColumn, listed
from stereocell.steps.labels import Labels
from stereocell.usd.primvar_names import RESERVED

_ENDS_IN_NUMBER = re.compile(r"_\d+$")  # such an ID may belong to the second column of a name
NAMES = "name"  # column with the names of objects in the label map's own file


def make_table(
    plan: Plan,
    labels: Labels,
    located: Located,
    facts: Mapping[str, ObjectFacts],
    notes: ObjectNotes,
    table: Table | None,
) -> tuple[ObjectTable, list[str]]:
    """Return the table of a label map's objects with all columns, and remarks for the user.

    facts  measurements of the built objects, by tile ID
    notes  names, colours and columns in the label map's own file
    table  the user's table; None: there is none, or it belongs to another label map

    Raises UsageError if the column of `--color-by` does not exist.
    """
    order = _order(located, facts)
    thin = np.unique(np.concatenate([one.thin for one in facts.values()]))
    known = located.extents
    names = known.labels[order]
    place_of = {label: row for row, label in enumerate(names.tolist())}
    rows = {
        tile: np.array([place_of[label] for label in one.labels.tolist()], np.int32)
        for tile, one in facts.items()
    }
    half = 0.5
    low = np.array(labels.origin_um) + (known.low[order] - half) * labels.spacing_um
    high = np.array(labels.origin_um) + (known.high[order] - half) * labels.spacing_um
    centre = np.array(labels.origin_um) + known.centroids[order] * labels.spacing_um
    volume = known.voxels[order] * float(np.prod(labels.spacing_um))
    place = Place(low, high, centre, volume.astype(np.float64))
    columns = own_columns(
        place, [(rows[tile], one) for tile, one in facts.items()], _measured(plan)
    )
    remarks: list[str] = []
    from_file = _columns_of_file(notes, names)
    # columns of a file with colours are not coloured by default: its own colours are better
    not_default = {column.name for column in from_file if notes.colors} - {NAMES}
    columns += from_file
    if table is not None:
        joined, remarks = _joined(table, names)
        columns += joined
        not_default -= {column.name for column in joined}
    columns, renamed = _unique(columns)
    corners = np.stack([zyx_to_xyz(low), zyx_to_xyz(high)])
    return (
        ObjectTable(
            names,
            np.hstack([corners.min(axis=0), corners.max(axis=0)]).astype(np.float32),
            rows,
            tuple(columns),
            tuple(notes.names.get(label, str(label)) for label in names.tolist())
            if notes.names
            else (),
            _default(
                columns,
                plan.settings.objects.color_by,
                not_default,
                is_first=labels.id == plan.labels[0].id,
            ),
            *_interfaces(facts, rows, names),
            _colors(notes, names),
        ),
        _notes_on_thin(labels, thin)
        + notes_on_stopped_levels(labels.name, facts)
        + remarks
        + renamed,
    )


def _interfaces(
    facts: Mapping[str, ObjectFacts],
    rows: Mapping[str, NDArray[np.int32]],
    labels: NDArray[np.uint64],
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Return the interfaces between objects: their rows, int32 (m, 2), and area, um^2 (m,).

    Each pair of objects appears once. Both objects measure their interface, and each piece of a cut
    object measures a part of it. The parts are summed, then the larger of the two sums is taken.
    """
    order = np.argsort(labels)
    found, areas = [np.zeros((0, 2), np.int64)], [np.zeros(0)]
    for tile, one in facts.items():
        at = np.searchsorted(labels[order], one.beside).clip(0, max(len(labels) - 1, 0))
        other = order[at] if len(order) else at
        known = labels[other] == one.beside if len(order) else np.zeros(0, bool)
        found.append(np.stack([rows[tile][one.interface_objects][known], other[known]], axis=1))
        areas.append(one.interface_um2[known])
    pairs, place = np.unique(np.concatenate(found), axis=0, return_inverse=True)
    sums = np.bincount(place.ravel(), np.concatenate(areas), len(pairs))
    interfaces, place = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
    largest = np.zeros(len(interfaces))
    np.maximum.at(largest, place.ravel(), sums)
    return interfaces.astype(np.int32), largest.astype(np.float32)


def _order(located: Located, facts: Mapping[str, ObjectFacts]) -> NDArray[np.int64]:
    """Return the indices of all built objects, sorted by tile, cut ones last."""
    whole = [np.flatnonzero(located.owners == located.tiles.index(tile)) for tile in facts]
    order = np.concatenate([*whole, np.flatnonzero(located.owners == CUT)])
    built = np.concatenate([one.labels for one in facts.values()])
    return order[np.isin(located.extents.labels[order], built)]


def _notes_on_thin(labels: Labels, thin: NDArray[np.uint64]) -> list[str]:
    """Return the note on objects that are too thin to be built, if there are any."""
    if not len(thin):
        return []
    return [
        f"{labels.name}: {counted(len(thin), 'object')} left out, too thin to be built, or full of "
        f"holes: {listed(thin.tolist())}; labels with finer voxels can hold them"
    ]


def _columns_of_file(notes: ObjectNotes, labels: NDArray[np.uint64]) -> list[Column]:
    """Return the columns that the label map's own file holds."""
    found = []
    listed_labels = labels.tolist()
    if notes.names:
        texts = [notes.names.get(label, "") for label in listed_labels]
        colors = {
            name: notes.colors[label]
            for label, name in notes.names.items()
            if label in notes.colors
        }
        made = category_column(NAMES, texts, "From the label map's file", colors=colors)
        found += [] if made is None else [made]
    for name, values in notes.columns.items():
        held = [values.get(label) for label in listed_labels]
        if any(isinstance(value, str) for value in held):
            texts = ["" if value is None else str(value) for value in held]
            made = category_column(name, texts, "From the label map's file")
            found += [] if made is None else [made]
        else:
            numbers = np.array([np.nan if value is None else float(value) for value in held])
            found.append(number_column(name, numbers, "From the label map's file"))
    return found


def _colors(notes: ObjectNotes, labels: NDArray[np.uint64]) -> NDArray[np.float32] | None:
    """Return the colours of objects in the label map's own file, (n, 3); None: it has none."""
    if not notes.colors:
        return None
    unknown = (np.nan,) * 3
    found = [notes.colors.get(label, unknown) for label in labels.tolist()]
    return np.array(found, np.float32).reshape(-1, 3)


def _joined(table: Table, labels: NDArray[np.uint64]) -> tuple[list[Column], list[str]]:
    """Return a table's columns in the order of the objects, and remarks on rows without a match."""
    order = np.argsort(table.labels, kind="stable")
    sorted_labels = table.labels[order]
    at = np.searchsorted(sorted_labels, labels).clip(0, max(len(order) - 1, 0))
    has_row = sorted_labels[at] == labels if len(order) else np.zeros(len(labels), bool)
    row = order[at] if len(order) else np.zeros(len(labels), np.int64)
    remarks = []
    unmatched = np.setdiff1d(table.labels, labels)
    if len(unmatched):
        remarks.append(
            f"{table.shown}: {counted(len(unmatched), 'row')} without an object: {table.key} "
            f"{listed(unmatched.tolist())}"
        )
    if not has_row.all():
        lacking = labels[~has_row]
        remarks.append(
            f"{table.shown}: {counted(len(lacking), 'object')} without a row: "
            f"{listed(lacking.tolist())}"
        )
    if table.left_out:
        remarks.append(
            f"{table.shown}: {counted(table.left_out, 'column')} beyond the first "
            f"{len(table.columns)} left out: choose columns by --columns"
        )
    found = []
    for column in table.columns:
        made = _column(column, row, has_row)
        if made is None:
            remarks.append(
                f"{table.shown}: column {column.name!r} left out: found more than 255 different "
                "texts, expected categories or numbers"
            )
        else:
            found.append(made)
    return found, remarks


def _column(
    column: TableColumn, row: NDArray[np.int64], has_row: NDArray[np.bool_]
) -> Column | None:
    if column.numbers is not None:
        padded = np.append(column.numbers, np.nan)
        return number_column(column.name, padded[np.where(has_row, row, -1)], "From the table")
    assert column.texts is not None
    texts = [column.texts[r] if has else "" for r, has in zip(row.tolist(), has_row, strict=True)]
    return category_column(column.name, texts, "From the table")


def _unique(columns: Sequence[Column]) -> tuple[list[Column], list[str]]:
    """Return the columns with unique IDs that do not clash with the primvars of a mesh."""
    found: dict[str, Column] = {}
    remarks = []
    for column in columns:
        name, number = column.id, 2
        while name in found or name in RESERVED:
            name, number = f"{column.id}_{number}", number + 1
        if column.id in found:
            remarks.append(f"column {column.name!r} exists twice: the second one is named {name}")
        found[name] = replace(column, id=name)
    return list(found.values()), remarks


def _default(
    columns: Sequence[Column], wanted: str, not_default: set[str], *, is_first: bool
) -> str:
    """Return the ID of the column that colours objects at first; empty: none.

    It is the wanted column, or else the first column of categories.

    not_default  names of columns that colour only if wanted
    is_first     whether this is the first label map, which must have the wanted column
    """
    for column in columns:
        if wanted and wanted in (column.name, column.id):
            return column.id
    if wanted and is_first:
        raise _no_column(wanted, [column.name for column in columns])
    categories = [one.id for one in columns if one.categories and one.name not in not_default]
    return categories[0] if categories else ""


def require_color_by(plan: Plan, labels: Labels, table: Table | None) -> None:
    """Raise UsageError if the column of `--color-by` does not exist."""
    wanted = plan.settings.objects.color_by
    if not wanted or labels.id != plan.labels[0].id:
        return
    none, notes = np.zeros((0, 3)), labels.open().notes
    own = own_columns(Place(none, none, none, np.zeros(0)), [], _measured(plan))
    has_names = bool(notes.names) or plan.settings.objects.segment_labels
    names = [column.name for column in own] + [NAMES] * has_names + list(notes.columns)
    names += [column.name for column in table.columns] if table else []
    ids = {column.id for column in own} | set(map(to_identifier, names))
    if wanted not in names and wanted not in ids and not _ENDS_IN_NUMBER.search(wanted):
        raise _no_column(wanted, names)


def _no_column(wanted: str, names: Sequence[str]) -> UsageError:
    return UsageError(f"--color-by is {wanted!r:.60}, expected one of {', '.join(names)}")


def _measured(plan: Plan) -> list[str]:
    """Return the names of the image's channels that are measured over objects."""
    return list(dict.fromkeys(channel.base or channel.name for channel in plan.channels))


def table_of(plan: Plan, labels: Labels) -> Table | None:
    """Return the user's table, if this is the first label map; None: there is no table for it.

    Raises SourceError if the table can't be read.
    """
    options = plan.settings.objects
    if not options.table or labels.id != plan.labels[0].id:
        return None
    return read_table(options.table, options.table_key, options.columns, labels.name)


def appearance_of_labels(labels: Labels, *, painter: str = "") -> Appearance:
    """Return the appearance of a label map's objects, which have no volume.

    painter  ID of the channel that is painted on them; empty: none is
    """
    window, points = (0.0, 1.0), ((0.0, 0.0), (1.0, 1.0))
    return Appearance(
        labels.name,
        labels.color,
        window,
        None,
        1.0,
        "clear",
        {DEFAULT_FUNCTION: points},
        painted_by=painter,
    )
