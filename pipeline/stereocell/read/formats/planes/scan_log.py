"""Read the voxel size of micro-CT slices from the log beside them; the images don't state it.

NRecon by Bruker (SkyScan) writes the log as `[Section]` and `key=value` lines, and slices as BMP
or TIFF. Other entries, such as the operator's name, are not read.
"""

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass

from stereocell.read.formats.planes.files import join
from stereocell.read.repeated_fields import settle_repeats
from stereocell.read.spacing import PartialTriple
from stereocell.read.statements import Statement, Subject, Trust, settle

_MAX_BYTES = 1 << 20
_LINE = re.compile(r"\s*(?:\[(?P<section>[^\]]*)\]|(?P<key>[^=]+)=(?P<value>.*))\s*")
# section and key of the pixel size -> its trust; pixels of the camera may be binned or scaled later
_SIZES = {
    ("reconstruction", "pixel size (um)"): Trust.STATED,
    ("acquisition", "image pixel size (um)"): Trust.DERIVED,
}
_STEP = ("reconstruction", "section to section step")  # lines of the camera between slices
_SECTIONS = ("reconstruction", "sections count")


@dataclass(frozen=True, slots=True)
class ScanLog:
    """The sizes in a log.

    path        path of the file
    statements  statements on the size of a pixel, um
    step        pixels between slices
    sections    number of slices that were written; None: not stated
    notes       notes on fields that the log states twice
    """

    path: str
    statements: tuple[Statement, ...]
    step: float
    sections: int | None = None
    notes: tuple[str, ...] = ()


def find_log(folder: str, image: str) -> ScanLog | None:
    """Return the log of a folder's slices; None: no log states a size.

    image  path of a slice in the folder, with `/`
    """
    below, _, name = image.rpartition("/")
    inside = join(folder, below) if below else folder
    logs = [entry for entry in os.listdir(inside) if entry.lower().endswith(".log")]
    # A log has the name of its slices, without their numbers.
    own = [log for log in logs if name.lower().startswith(log.lower().removesuffix(".log"))]
    for log in sorted(own or logs, key=len, reverse=True):
        found = _read(os.path.join(inside, log))
        if found.statements:
            return found
    return None


def with_log(
    stated_um: PartialTriple, log: ScanLog | None, slices: Sequence[int]
) -> tuple[PartialTriple, list[str]]:
    """Return a spacing (z, y, x), um, completed from a log, and notes on the log.

    stated_um  spacing that the images state
    slices     numbers of the slices, which count lines of the camera
    """
    if log is None:
        return stated_um, []
    number_step = slices[1] - slices[0] if len(slices) > 1 else 1
    in_plane = stated_um[2]
    statements = list(log.statements)
    if in_plane is not None:
        statements.insert(0, Statement(in_plane, "the images"))
    subject = Subject("pixel size", "um", remedy="--spacing-um z,y,x replaces it")
    settled = settle(subject, statements)
    pixel = settled.number
    is_measured = Trust.MEASURED if number_step > 1 else Trust.DERIVED
    steps = [
        Statement(log.step, "the log"),
        Statement(float(number_step), "the slices' numbering", is_measured),
    ]
    step = settle(Subject("step from slice to slice", "pixels"), steps)
    sizes = (pixel * step.number, pixel, pixel)
    z, y, x = (own if own is not None else size for own, size in zip(stated_um, sizes, strict=True))
    size_note = f"the voxel size comes from the scanner's log: {pixel:g} um"
    return (z, y, x), [
        size_note,
        *log.notes,
        *settled.notes,
        *step.notes,
        *_missing_slices(log, len(slices)),
    ]


def _missing_slices(log: ScanLog, slices: int) -> list[str]:
    """Return a note if the number of slices in the log differs from the number of images."""
    if log.sections is None or log.sections == slices:
        return []
    rest = "the others may be lost" if log.sections > slices else "some may belong to another scan"
    return [f"slices: found {slices} images, and the log states {log.sections}: {rest}"]


def _read(path: str) -> ScanLog:
    with open(path, encoding="latin-1", errors="replace") as file:
        text = file.read(_MAX_BYTES)
    section, lines = "", []
    for line in text.splitlines():
        found = _LINE.fullmatch(line)
        if found is None:
            continue
        if found["section"] is not None:
            section = found["section"].strip().lower()
        elif (number := _positive(found["value"])) is not None:
            key = (section, found["key"].strip().lower())
            if key in (*_SIZES, _STEP, _SECTIONS):
                lines.append((_named(key), str(number)))
    texts, notes = settle_repeats(lines, "the log")
    numbers = {
        key: float(texts[_named(key)])
        for key in (*_SIZES, _STEP, _SECTIONS)
        if _named(key) in texts
    }
    statements = [
        Statement(numbers[key], f"[{key[0].capitalize()}] of the log", trust)
        for key, trust in _SIZES.items()
        if key in numbers
    ]
    sections = numbers.get(_SECTIONS)
    return ScanLog(
        path,
        tuple(statements),
        numbers.get(_STEP, 1.0),
        sections=round(sections) if sections is not None else None,
        notes=notes,
    )


def _named(key: tuple[str, str]) -> str:
    """Return a field with its section, in the form of the log."""
    return f"[{key[0].capitalize()}] {key[1]}"


def _positive(text: str) -> float | None:
    try:
        number = float(text.strip().replace(",", "."))
    except ValueError:
        return None
    return number if 0 < number < float("inf") else None
