"""Errors that a user can cause or repair: one line, exit code 1 (2 for wrong usage).

All other exceptions are bugs and keep their traceback.
"""


class StereoCellError(Exception):
    """The message names the file or tile and the field, the value found and the value expected."""

    exit_code = 1


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
