"""Notes for the user on how a source is read. They are not part of any result."""

from typing import Any

import numpy as np

from stereocell.read.cast import built_dtype

LEFT_OUT = "files left out"  # first words of the note on files of a set that are not read
CAST = "voxels are"  # first words of the note on a conversion of the number type


def cast_note(stored: Any) -> str:
    """Return a sentence on how the number type is converted; empty: it stays as it is."""
    dtype, built = np.dtype(stored), built_dtype(stored)
    if built is None or dtype.name == built.name:
        return ""
    note = f"{CAST} {dtype.name}: read as {built.name}"
    if dtype.kind in "iu" and built.kind == "f":
        return (
            f"{note}, which keeps 24 of {8 * dtype.itemsize} bits: whole numbers beyond "
            "16,777,216 are rounded"
        )
    if dtype.name == "float64":
        return f"{note}, which keeps 7 of 16 digits"
    return f"{note}, without loss"


def choice_notes(images: int, time_points: int, time: int) -> tuple[str, ...]:
    """Return a sentence on each choice of an image or a time point among several."""
    notes = []
    if images > 1:
        notes.append(f"{images} images in the source; building only the first")
    if time_points > 1:
        notes.append(f"{time_points} time points; building --time {time}")
    return tuple(notes)
