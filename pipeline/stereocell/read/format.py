"""All that is known of a format before a source of it is opened: one row, in its own module.

A module or package of `read/formats` holds one format, with its row as `FORMAT`. It imports its
library only when a source is opened, since the rows of all formats are loaded together.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from stereocell.read.chunk_counts import Absent, Spans
from stereocell.read.extras import require_installed
from stereocell.read.image import Image
from stereocell.storage.file_states import FileStates
from stereocell.storage.first_bytes import Mark
from stereocell.storage.location import Location


class Guide(NamedTuple):
    """A row of the table of formats in docs/input-formats.md, in Markdown.

    input  how a source is named
    read   the metadata that are read, or a link to a section
    """

    format: str
    input: str
    read: str


class Library(NamedTuple):
    """A library that an extra of StereoCell installs.

    reads  the files that need it, in words
    """

    import_name: str
    extra: str
    reads: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One format of sources.

    title            the usual name; a part in brackets says how a source is named
    guides           its rows in the docs
    open             `open(location) -> Image`, with the options below that the format takes
    list_series      returns a line for each image of a source; it may hold several, so `open` takes
                     `series`. None: it holds one
    order            a sentence on the order of these images; empty: the source's own
    has_pattern      names of files may tell their places: `open` takes `pattern`
    has_axes         a source may not name its axes: `open` takes `axes`
    has_parts        a source may be a part of a file: `NAME.h5:/KEY`, `NAME.zarr.zip/0`
    has_plain_names  files are named by numbers; else a name may identify a patient
    is_remote        a source may lie at an address
    version          is raised when the same file gives other voxels or another place: a part of the
                     key of each result
    library          the library that it needs beyond StereoCell's own
    decoders         a library that unpacks more of its files than StereoCell's own do
    endings          of its files' names, in lower case, the usual one first
    loose_endings    of files whose first bytes may state another format, which is then taken
    folder_endings   of its folders' names: all in such a folder is of the format
    addresses        recognises an address whose names have no ending
    holds            recognises a source on this machine by looking into it. An ending is not enough
                     for a format that has both
    marks            recognise a file whose name has no ending of a format
    needs_ending     marks do not suffice, because its library goes by the name
    may_hold         recognises a source that no format has recognised otherwise
    is_unmarked      returns whether a file, by its path and first bytes, may be of the format
                     although it has none of its marks
    packed_endings   of files that are packed by gzip; the bytes in them are checked
    count_absent     counts the chunks of a part of an array that are not stored; None: all are
    read_free_labels returns the free text by which a label map names each object
    name, module     of the module that holds the row; `known_formats` fills them in
    """

    title: str
    open: Callable[..., Image]
    guides: tuple[Guide, ...] = ()
    list_series: Callable[[Location], tuple[str, ...]] | None = None
    order: str = ""
    has_pattern: bool = False
    has_axes: bool = False
    has_parts: bool = False
    has_plain_names: bool = False
    is_remote: bool = False
    version: int = 1
    library: Library | None = None
    decoders: Library | None = None
    endings: tuple[str, ...] = ()
    loose_endings: tuple[str, ...] = ()
    folder_endings: tuple[str, ...] = ()
    addresses: re.Pattern[str] | None = None
    holds: Callable[[Location], bool] | None = None
    marks: tuple[Mark, ...] = ()
    needs_ending: bool = False
    may_hold: Callable[[Location], bool] | None = None
    is_unmarked: Callable[[str, bytes], bool] | None = None
    packed_endings: tuple[str, ...] = ()
    count_absent: Callable[[Any, Spans, FileStates], Absent | None] | None = None
    read_free_labels: Callable[[Location], dict[int, str]] | None = None
    name: str = ""
    module: str = ""

    @property
    def short_title(self) -> str:
        """The title without its part in brackets."""
        return self.title.partition(" (")[0]

    @property
    def has_series(self) -> bool:
        """Whether a source may hold several images."""
        return self.list_series is not None

    def require_library(self, location: Location) -> None:
        """Raise SourceError, with the command that installs it, where the library is missing."""
        if self.library is not None:
            name, extra = self.library.import_name, self.library.extra
            require_installed(name, extra, location.shown, self.short_title)
