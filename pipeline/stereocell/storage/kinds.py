"""The kinds of contents of a path that commands distinguish (contents.py)."""

from enum import StrEnum


class Kind(StrEnum):
    """A kind of contents. The values are words for messages."""

    NOTHING = "nothing"
    BUILD = "a build"
    STAGE = "a stage"
    BUNDLE = "a bundle"
    SITE = "a published page"
    SCENE = "a scene in one file"
    SLICES = "slices"
    PART = "another part of a build"
    FOLDER = "another folder"
    FILE = "a file"
