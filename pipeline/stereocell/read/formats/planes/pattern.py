"""Read file names by the user's pattern, such as `img_c{c}_z{z}.tif`."""

import re
from collections.abc import Sequence

from stereocell.model.errors import UsageError
from stereocell.read.formats.planes.place import Place

_PARTS = {
    "{z}": r"(?P<z>[0-9]+)",
    "{t}": r"(?P<t>[0-9]+)",
    "{c}": r"(?P<c>[^/]+?)",
    "*": r"[^/]*?",
}
_MAX_STARS = 4  # `*` in a pattern; each multiplies the time that matching a name takes
_EXPECTED = (
    "expected a name with {z} for the plane's number and, if needed, {c} for the channel, {t} for "
    "the time, and * for text that doesn't matter, such as img_c{c}_z{z}.tif"
)


def read_by_pattern(paths: Sequence[str], pattern: str) -> tuple[Place, ...]:
    """Return the places of the files that match; other files are left out.

    A pattern without `/` covers only files in the folder itself. Raises UsageError where the
    pattern is invalid or no file matches.
    """
    form = _compiled(pattern)
    found = []
    for path in paths:
        match = form.fullmatch(path)
        if match is None:
            continue
        groups = match.groupdict()
        plane = groups.get("z")
        found.append(
            Place(
                path,
                channel=groups.get("c") or "",
                time=int(groups.get("t") or 0),
                plane=None if plane is None else int(plane),
                digits=(0, 0) if plane is None else match.span("z"),
            )
        )
    if not found:
        example = f", such as {paths[0]!r:.100}" if paths else ""
        raise UsageError(
            f"--pattern is {pattern!r}: none of {len(paths)} files matches{example}; {_EXPECTED}"
        )
    return tuple(found)


def _compiled(pattern: str) -> re.Pattern[str]:
    parts = re.split(r"(\{[^{}]*\}|\*+)", pattern)
    parts[1::2] = [part[:1] if part.startswith("*") else part for part in parts[1::2]]
    fields = [part for part in parts[1::2] if part != "*"]
    unknown = [part for part in fields if part not in _PARTS]
    many = parts.count("*") > _MAX_STARS
    if not pattern or unknown or many or len(set(fields)) < len(fields) or len(pattern) > 500:
        reason = f": {unknown[0]} is unknown" if unknown else ""
        reason = f": more than {_MAX_STARS} *" if many else reason
        raise UsageError(f"--pattern is {pattern!r:.200}{reason}; {_EXPECTED}")
    escaped = [_PARTS[part] if i % 2 else re.escape(part) for i, part in enumerate(parts)]
    return re.compile("".join(escaped))
