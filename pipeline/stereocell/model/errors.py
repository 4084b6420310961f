"""Errors that a user can cause or repair: one line, and exit code 1 (2 for wrong usage).

All other exceptions are bugs and keep their traceback.
"""

import re

# Characters: a value of at least _LONGEST is shortened to its first and last ones. Paths are seldom
# so long, and file names never.
_LONGEST, _KEPT_AHEAD, _KEPT_BEHIND = 300, 200, 60
_LONG_VALUE = re.compile(rf"\S{{{_LONGEST},}}|'[^'\n]{{{_LONGEST},}}'|\"[^\"\n]{{{_LONGEST},}}\"")


class StereoCellError(Exception):
    """An error whose message names the file or tile, the field, the value found and the expected.

    Long values in the message are shortened in their middle.
    """

    exit_code = 1

    def __str__(self) -> str:
        return _LONG_VALUE.sub(lambda value: shortened(value[0]), super().__str__())


def shortened(value: str) -> str:
    """Return a value, without its middle if it is long."""
    if len(value) < _LONGEST:
        return value
    return f"{value[:_KEPT_AHEAD]}...{value[-_KEPT_BEHIND:]}"


class UsageError(StereoCellError):
    """The command itself is wrong, such as an unknown key, or a flag that contradicts another."""

    exit_code = 2


class SourceError(StereoCellError):
    """The input can't be read as a volume."""


class OutputError(StereoCellError):
    """OUT can't be written, or holds something other than a build."""


class NoSurfaceError(StereoCellError):
    """The voxels have no iso-surface. The caller records the reason, and the build continues."""


class StageError(StereoCellError):
    """A USD stage lacks something that the bundle needs."""


class CheckError(StereoCellError):
    """An output breaks the rules of its format."""
