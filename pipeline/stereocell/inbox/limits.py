"""All limits of the inbox; docs/inbox.md lists them for readers."""

from dataclasses import dataclass

UPLOAD_BYTES = 50_000_000_000  # bytes of one upload, where no flag says otherwise
MAX_FILES = 50_000  # files of one upload, or in its archive
MAX_ITEMS = 200  # items in the inbox
PIECE_BYTES = 4 << 20  # bytes of one piece of an upload
UNFINISHED_H = 24.0  # hours without a byte after which an unfinished upload is removed
RESERVE_BYTES = 1 << 30  # bytes of the disk that no upload may take

NAME_BYTES = 255  # bytes of one part of a name, in UTF-8
NAME_CHARS = 1000  # characters of a name with its folders
MAX_FOLDERS = 31  # folders in a name

PACKED_RATIO = 100  # bytes unpacked for each byte of an archive
ALWAYS_BYTES = 64 << 20  # bytes that an archive may unpack to, however small it is

ADDRESS_CHARS = 2000  # characters of an address
READ_S = 600.0  # s for one step of reading: unpacking, understanding, a first view
UNPACK_S = 3600.0  # s for unpacking an archive
MEMORY_SHARE = 0.6  # share of the free memory that reading may take


@dataclass(frozen=True, slots=True)
class InboxLimits:
    """The limits of one inbox.

    bytes  of one upload, and of what its archive unpacks to
    """

    bytes: int = UPLOAD_BYTES
    files: int = MAX_FILES
    items: int = MAX_ITEMS
    piece: int = PIECE_BYTES
    hours: float = UNFINISHED_H
    reserve: int = RESERVE_BYTES
