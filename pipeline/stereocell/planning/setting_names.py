"""Name settings in messages by flags for users of a shell, by section and key for all others."""

import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import Field, fields
from typing import Any

from stereocell.model.errors import StereoCellError
from stereocell.model.settings import Flag
from stereocell.planning.settings import Settings


def flagged_settings() -> Iterator[tuple[Flag, tuple[str, ...], Field[Any]]]:
    """Yield each setting that has a flag: the flag, the section and key, the field."""
    for section in fields(Settings()):
        if section.metadata:
            yield section.metadata["flag"], (section.name,), section
            continue
        for field in fields(getattr(Settings(), section.name)):
            if field.metadata["flag"] is not None:
                yield field.metadata["flag"], (section.name, field.name), field


def in_flags(line: str, given: Collection[str]) -> str:
    """Return a message with flags in place of the settings that were given by flags.

    given  names of the flags

    >>> in_flags("command line: plan.grid is 3, expected text", ["--grid"])
    '--grid is 3, expected text'
    """
    for flag, place, _ in flagged_settings():
        if flag.name in given:
            is_by_channel = len(place) == 1
            named = rf"{place[0]}\." if is_by_channel else rf"{place[0]}\.{place[1]}\b"
            shown = f"{flag.name} " if is_by_channel else flag.name
            line = re.sub(rf"(?<![\w.])(?:command line: )?{named}", shown, line)
    return line


def in_settings(line: str, *, has_sections: bool = True) -> str:
    """Return a message with settings in place of flags.

    has_sections  whether settings are named with their section; False: as arguments of Python

    >>> in_settings("--grid is '3', expected columns x rows; --iso-value CD8: found -1")
    "plan.grid is '3', expected columns x rows; iso_values.CD8: found -1"
    """
    for flag, place, _ in flagged_settings():
        place = place if has_sections else place[-1:]
        named = rf"(?<![\w-]){flag.name}(?![\w-])"
        if has_sections and len(place) == 1:  # a setting by channel, whose name follows the flag
            line = re.sub(rf"{named} (?!names |is |says )(?=\S)", f"{place[0]}.", line)
        line = re.sub(named, ".".join(place), line)
    return re.sub(r"(?<![\w-])--(preset|config|workers|scheduler)\b", r"\1", line)


@contextmanager
def named_as_settings(*, has_sections: bool = True) -> Iterator[None]:
    """Rewrite the errors of the block by `in_settings`, for users of Python."""
    try:
        yield
    except StereoCellError as error:
        error.args = (in_settings(str(error), has_sections=has_sections),)
        raise
