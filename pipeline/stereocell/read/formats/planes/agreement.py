"""Compare the files of a folder: a volume has one voxel size and one kind of pixels."""

from collections.abc import Mapping, Sequence

import numpy as np

from stereocell.model.errors import SourceError
from stereocell.read.formats.planes.head import Head
from stereocell.read.plane_positions import drift_notes, settle_places
from stereocell.read.spacing import PartialTriple
from stereocell.read.statements import Statement, Subject, settle
from stereocell.read.value_scale import dtype_of_values

_REMEDY = "--spacing-um z,y,x replaces it"
_TOLERANCE = 1e-3  # relative difference up to which two sizes agree


def settle_sizes(
    stated: Mapping[str, PartialTriple],
) -> tuple[PartialTriple, tuple[str, ...]]:
    """Return the voxel size (z, y, x), um, of the files of one volume, and notes.

    stated  the size that each file states, by its name; the first one is used if they differ
    """
    found: list[float | None] = []
    notes: list[str] = []
    for axis, name in enumerate("zyx"):
        statements = _distinct({file: sizes[axis] for file, sizes in stated.items()})
        if not statements:
            found.append(None)
            continue
        settled = settle(Subject(f"voxel spacing along {name}", "um", remedy=_REMEDY), statements)
        found.append(settled.number)
        notes += settled.notes
    z, y, x = found
    return (z, y, x), tuple(notes)


def _distinct(sizes: Mapping[str, float | None]) -> list[Statement]:
    """Return a statement for each distinct size, with the first file that states it."""
    found: list[Statement] = []
    for file, size in sizes.items():
        known = [float(one.value) for one in found if isinstance(one.value, float | int)]
        if size is not None and not any(np.isclose(size, one, _TOLERANCE, 0) for one in known):
            found.append(Statement(size, file))
    return found


def settle_depth_of_planes(
    heads: Sequence[Head], stated_um: float | None
) -> tuple[float | None, tuple[str, ...]]:
    """Return the distance between planes, um, from positions that all planes state, and notes.

    heads      heads in the order of the planes
    stated_um  the distance that the files state; None: no file does
    """
    places = {n: head.z_um for n, head in enumerate(heads) if head.z_um is not None}
    if len(places) < len(heads):
        return stated_um, ()
    stated = [] if stated_um is None else [Statement(stated_um, "the size in each file")]
    return settle_places(
        places, stated, heads[0].z_field, has_unit=all(head.has_z_unit for head in heads)
    )


def drift_notes_of_planes(heads: Sequence[Head], spacing_um: PartialTriple) -> tuple[str, ...]:
    """Return notes if planes of one stack were taken at different positions along y or x."""
    notes: list[str] = []
    for place, axis in enumerate("yx"):
        found = {n: head.yx_um[place] for n, head in enumerate(heads)}
        known = {n: um for n, um in found.items() if um is not None}
        if len(known) == len(heads):
            field = f"Position{axis.upper()}"
            notes += drift_notes(known, field, axis, spacing_um[1 + place])
    return tuple(notes)


def require_one_kind(where: str, heads: Mapping[str, Head]) -> None:
    """Raise SourceError where 0 is white in some files and black in others."""
    white = [file for file, head in heads.items() if head.is_inverse]
    if white and len(white) < len(heads):
        raise SourceError(
            f"{where}: PhotometricInterpretation: found 0 for white in {len(white)} of "
            f"{len(heads)} planes, such as {white[0]!r:.100}, expected the same in all: invert "
            "those"
        )


def dtype_of_planes(heads: Sequence[Head]) -> np.dtype[np.generic]:
    """Return a dtype that holds the values of all planes."""
    return np.result_type(*{dtype_of_values(head.dtype, head.values) for head in heads})


def notes_of_planes(heads: Sequence[Head]) -> list[str]:
    """Return the notes on planes without repeats, with the number of planes if not all have one."""
    notes = dict.fromkeys(note for head in heads for note in head.notes)
    counts = {note: sum(note in head.notes for head in heads) for note in notes}
    total = len(heads)
    return [
        note if counts[note] == total else f"{counts[note]} of {total} planes: {note}"
        for note in notes
    ]
