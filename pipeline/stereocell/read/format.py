"""All that is known about a format before a source is opened: one row, in the format's own module.

Each module or package of `read/formats` holds one format, with its row as `FORMAT`. It imports its
library only when a source is opened, because the rows of all formats are loaded together.
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

    input  how to name a source
    read   metadata that are read, or a link to a section
    """

    format: str
    input: str
    read: str


class Library(NamedTuple):
    """A library that an extra of StereoCell installs.

    reads  description of the files that need it
    """

    import_name: str
    extra: str
    reads: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Format:
    """One format of sources.

    title            usual name; a part in brackets explains how to name a source
    guides           rows in the table of formats in the docs
    open             `open(location) -> Image`, plus the options below that the format accepts
    list_series      returns a line for each image of a source that may hold several; `open` then
                     accepts `series`. None: a source holds one image
    order            a sentence on the order of these images; empty: the source's own order
    has_pattern      file names may state places, so `open` accepts `pattern`
    has_axes         a source may not name its axes, so `open` accepts `axes`
    has_parts        a source may be a part of a file: `NAME.h5:/KEY`, `NAME.zarr.zip/0`
    has_plain_names  files are named by numbers; otherwise a name may identify a patient
    is_remote        a source may be at an address
    version          part of each result's key; raised when the same file gives other voxels or
                     another place
    library          library that the format needs beyond StereoCell's own
    decoders         library that decodes more of its files than StereoCell's own libraries do
    endings          endings of file names, in lower case, the usual one first
    loose_endings    endings that other formats share; first bytes of another format take precedence
    folder_endings   endings of folder names: everything in such a folder has this format
    addresses        recognises an address whose names have no ending
    holds            recognises a source on this machine by looking into it. For a format with
                     `holds`, an ending alone is not enough
    marks            first bytes that recognise a file whose name has no known ending
    needs_ending     marks alone are not enough, because the format's library goes by the name
    may_hold         recognises a source that no format has recognised otherwise
    is_unmarked      returns whether a file, by its path and first bytes, may have this format
                     although it has none of its marks
    packed_endings   endings of files that are compressed by gzip; their content is checked
    count_absent     counts the chunks of a part of an array that are not stored; None: the format
                     has no absent chunks
    read_free_labels returns the free text by which a label map names each object
    name, module     name and import path of the row's module; `known_formats` fills them in
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
        """The title without the part in brackets."""
        return self.title.partition(" (")[0]

    @property
    def has_series(self) -> bool:
        """Whether a source may hold several images."""
        return self.list_series is not None

    def require_library(self, location: Location) -> None:
        """Raise SourceError, with the command that installs the library, if it is missing."""
        if self.library is not None:
            name, extra = self.library.import_name, self.library.extra
            require_installed(name, extra, location.shown, self.short_title)
