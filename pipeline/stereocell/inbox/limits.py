"""All limits of the inbox; docs/inbox.md lists them for users."""

from dataclasses import dataclass

UPLOAD_BYTES = 50_000_000_000  # bytes, largest upload unless a flag sets another limit
MAX_FILES = 50_000  # most files of one upload, or in its archive
MAX_ITEMS = 200  # most items in the inbox
PIECE_BYTES = 4 << 20  # bytes, largest piece of an upload
UNFINISHED_H = 24.0  # hours without a byte after which an unfinished upload is removed
RESERVE_BYTES = 1 << 30  # bytes of the disk that uploads must leave free

NAME_BYTES = 255  # bytes in UTF-8, longest part of a name
NAME_CHARS = 1000  # characters, longest name with its folders
MAX_FOLDERS = 31  # most folders in a name

PACKED_RATIO = 100  # most bytes that each byte of an archive may unpack to
ALWAYS_BYTES = 64 << 20  # bytes that even the smallest archive may unpack to

ADDRESS_CHARS = 2000  # characters, longest address
READ_S = 600.0  # s, longest time to read an upload or to make a first view
UNPACK_S = 3600.0  # s, longest time to unpack and arrange an upload
MEMORY_SHARE = 0.6  # share of the free memory that reading may take


@dataclass(frozen=True, slots=True)
class InboxLimits:
    """The limits of one inbox.

    bytes    largest upload, and largest content of its archive
    files    most files of one upload, or in its archive
    items    most items in the inbox
    piece    bytes, largest piece of an upload
    hours    hours without a byte after which an unfinished upload is removed
    reserve  bytes of the disk that uploads must leave free
    """

    bytes: int = UPLOAD_BYTES
    files: int = MAX_FILES
    items: int = MAX_ITEMS
    piece: int = PIECE_BYTES
    hours: float = UNFINISHED_H
    reserve: int = RESERVE_BYTES
