"""The place of a file in a folder of planes: its channel, time point and plane."""

import re
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Place:
    """One file.

    path     path relative to the folder, with `/`
    group    parts of its name that identify a series, position or well; files of a group form one
             volume
    channel  channel as the name states it: `ch00`, `DAPI`; empty: none
    time     number in the name; 0 where it has none
    plane    number along z in the name; None: it has none (each file is a stack)
    digits   start and stop of the plane's number in `path`
    """

    path: str
    group: str = ""
    channel: str = ""
    time: int = 0
    plane: int | None = None
    digits: tuple[int, int] = (0, 0)

    def path_of(self, plane: int) -> str:
        """Return the path that another plane would have, with as many digits."""
        start, stop = self.digits
        return f"{self.path[:start]}{plane:0{stop - start}d}{self.path[stop:]}"


def natural(text: str) -> tuple[tuple[int, int | str], ...]:
    """Return a key that sorts numbers in a text by value: `z2` before `z10`."""
    parts = re.split(r"([0-9]+)", text)
    return tuple((1, int(part)) if part.isdecimal() else (0, part) for part in parts)
