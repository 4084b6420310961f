"""Guess which channel, time and plane each file holds from the names of all files.

Names are split at separators into columns. A column whose values differ only in their numbers is
split into its numbers. The letters before a number give its meaning (`z012`, `ch01`, `w2`, `t5`,
`s3`). The last number without such letters is the plane; a column of words is the channel. Other
columns (wells, sites, series) divide the files into groups, each a separate volume.
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from stereocell.read.formats.planes.place import Place, natural

_Z = {"z", "zstep", "zplane", "zpos", "slice", "sl", "plane", "section", "sec"}
_C = {"c", "ch", "chan", "channel", "w", "wv", "wave", "wavelength", "lambda", "color", "colour"}
_T = {"t", "tp", "time", "timepoint"}
_GROUPS = {
    *("s", "site", "p", "pos", "position", "xy", "f", "field", "fov", "series", "m", "tile"),
    *("well", "row", "col", "r", "scene", "stage", "v", "view", "region"),
}
COUNTERS = _Z | _C | _T | _GROUPS  # letters before a number that state what it counts
_SEPARATORS = (re.compile(r"[/_\-\s.]+"), re.compile(r"[/_\s]+"))
_WELL = re.compile(r"[A-P][0-9]{2}")
_GUID = re.compile(r"[0-9A-Fa-f]{8}(-[0-9A-Fa-f]{4}){3}-[0-9A-Fa-f]{12}")
_MAX_CHANNELS = 40  # values of a number without letters; with more, it doesn't count channels
_SUFFIX = re.compile(r"(\.ome)?\.[A-Za-z0-9]+$")


@dataclass(slots=True)
class _Field:
    """A part of the names that differs from file to file.

    label      letters before it, in lower case
    values     value in each file name
    spans      start and stop of the value in each path
    is_number  whether it consists of digits only
    """

    label: str
    values: list[str]
    spans: list[tuple[int, int]]
    is_number: bool

    @property
    def count(self) -> int:
        return len(set(self.values))


def guess(paths: Sequence[str], are_stacks: bool) -> tuple[Place, ...]:
    """Return the places of the files; files whose names have another form are missing.

    paths       relative to the folder, in natural order
    are_stacks  whether each file itself holds planes along z
    """
    best: tuple[Place, ...] = ()
    # hyphens may be separators, or parts of names that then differ in their number of parts
    for separators in _SEPARATORS:
        places = _guess(paths, are_stacks, separators)
        has_planes = are_stacks or places[0].plane is not None
        if not best or (has_planes and len(places) > len(best)):
            best = places
    return best


def _guess(
    paths: Sequence[str], are_stacks: bool, separators: re.Pattern[str]
) -> tuple[Place, ...]:
    """Return the places of the files whose names have the commonest number of parts."""
    columns = [_columns(path, separators) for path in paths]
    usual = Counter(map(len, columns)).most_common(1)[0][0]
    kept = [i for i, found in enumerate(columns) if len(found) == usual]
    paths = [paths[i] for i in kept]
    fields = _fields(paths, [columns[i] for i in kept])
    plane, channel, time = _roles(fields, are_stacks)
    groups = [field for field in fields if field not in (plane, channel, time)]
    return tuple(
        Place(
            path,
            group=" ".join(f"{field.label}{field.values[i]}" for field in groups),
            channel=f"{channel.label}{channel.values[i]}" if channel else "",
            time=int(time.values[i]) if time else 0,
            plane=int(plane.values[i]) if plane else None,
            digits=plane.spans[i] if plane else (0, 0),
        )
        for i, path in enumerate(paths)
    )


def _columns(path: str, separators: re.Pattern[str]) -> list[tuple[int, int]]:
    """Return start and stop of each part of a name, without its suffix and random identifiers."""
    ends = _SUFFIX.search(path)
    stem = path[: ends.start()] if ends else path
    stem = _GUID.sub(lambda found: " " * len(found[0]), stem)
    cuts = [(0, 0), *(found.span() for found in separators.finditer(stem))]
    stops = [*(start for start, _ in cuts[1:]), len(stem)]
    return [(start, stop) for (_, start), stop in zip(cuts, stops, strict=True) if stop > start]


def _fields(paths: Sequence[str], columns: Sequence[list[tuple[int, int]]]) -> list[_Field]:
    found = []
    before = ""  # words in the column before, which may explain a number without letters
    for place in range(len(columns[0])):
        spans = [one[place] for one in columns]
        texts = [path[start:stop] for path, (start, stop) in zip(paths, spans, strict=True)]
        skeletons = {re.sub(r"[0-9]+", "0", text) for text in texts}
        if len(set(texts)) == 1:
            before = texts[0].lower() if texts[0].isalpha() else ""
            continue
        if len(skeletons) > 1 or all(_WELL.fullmatch(text) for text in texts):
            is_well = all(_WELL.fullmatch(text) for text in texts)
            found.append(_Field("well " if is_well else "", texts, spans, False))
        else:
            found += _numbers(texts, spans, before)
        before = ""
    return found


def _numbers(texts: list[str], spans: list[tuple[int, int]], before: str) -> list[_Field]:
    """Return the numbers that differ in a column whose other characters are the same."""
    found = []
    runs = [list(re.finditer(r"[0-9]+", text)) for text in texts]
    for index, first in enumerate(runs[0]):
        values = [one[index][0] for one in runs]
        if len(set(values)) == 1:
            continue
        letters = re.search(r"[A-Za-z]*$", texts[0][: first.start()])
        label = letters[0].lower() if letters else ""
        if not label and first.start() == 0:
            label = before if before in _Z | _C | _T | _GROUPS else ""
        places = [
            (start + one[index].start(), start + one[index].end())
            for (start, _), one in zip(spans, runs, strict=True)
        ]
        found.append(_Field(label, values, places, True))
    return found


def _roles(
    fields: list[_Field], are_stacks: bool
) -> tuple[_Field | None, _Field | None, _Field | None]:
    """Return the fields of plane, channel and time; None for each one that is missing."""
    numbers = [field for field in fields if field.is_number]
    planes = [field for field in numbers if field.label in _Z]
    times = [field for field in numbers if field.label in _T]
    channels = [field for field in numbers if field.label in _C]
    plane = planes[-1] if planes else None
    time = times[-1] if times else None
    channel = channels[0] if channels else None
    taken = [*planes, *times, *channels[:1]]
    others = [f for f in numbers if f not in taken and f.label not in _GROUPS]
    words = [f for f in fields if not f.is_number and f.label != "well "]
    if plane is None and not are_stacks:
        # The last number without letters; a lone `ch` or `s` counts slices after all.
        rest = others or ([] if len(fields) > 1 else fields)
        plane = next((field for field in reversed(rest) if field.is_number), None)
        if plane is None and channel is not None and len(numbers) == 1 and not words:
            plane = channel
        if plane is not None and plane is channel:
            channel = None
        others = [field for field in others if field is not plane]
    if channel is None:
        few = [field for field in others if field.count <= _MAX_CHANNELS]
        channel = next(iter(words or few), None)
    return plane, channel, time


def template_of(place: Place) -> str:
    """Return a file's path with {z} in place of its plane's number."""
    start, stop = place.digits
    return f"{place.path[:start]}{{z}}{place.path[stop:]}" if stop else place.path


def in_natural_order(paths: Sequence[str]) -> list[str]:
    """Return paths sorted by the values of their numbers, then by their text."""
    return sorted(paths, key=lambda path: (natural(path), path))
