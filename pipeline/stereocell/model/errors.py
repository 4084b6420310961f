"""Errors that a user can cause or repair: one line, exit code 1 (2 for wrong usage).

All other exceptions are bugs and keep their traceback.
"""

import re

# Values of more characters are cut. A path is seldom as long, and a file's name never.
_LONGEST, _KEPT_AHEAD, _KEPT_BEHIND = 300, 200, 60
_LONG_VALUE = re.compile(rf"\S{{{_LONGEST},}}|'[^'\n]{{{_LONGEST},}}'|\"[^\"\n]{{{_LONGEST},}}\"")


class StereoCellError(Exception):
    """The message names the file or tile and the field, the value found and the value expected.

    A value of many characters is cut in its middle, wherever the message quotes it.
    """

    exit_code = 1

    def __str__(self) -> str:
        return _LONG_VALUE.sub(lambda value: shortened(value[0]), super().__str__())


def shortened(value: str) -> str:
    """Return a value, with its middle left out where it is long."""
    if len(value) < _LONGEST:
        return value
    return f"{value[:_KEPT_AHEAD]}...{value[-_KEPT_BEHIND:]}"


class UsageError(StereoCellError):
    """The command itself is wrong: an unknown key, a flag that contradicts another."""

    exit_code = 2


class SourceError(StereoCellError):
    """The input can't be read as a volume."""


class OutputError(StereoCellError):
    """OUT can't be written, or holds something other than a build."""


class NoSurfaceError(StereoCellError):
    """The voxels have no iso-surface. The caller records the reason, and the build goes on."""


class StageError(StereoCellError):
    """A USD stage lacks something that the bundle needs."""


class CheckError(StereoCellError):
    """An output breaks the rules of its format."""
