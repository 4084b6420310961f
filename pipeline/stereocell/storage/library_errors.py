"""Errors of the format libraries on damaged, unusual or unreachable sources, as one line."""

import logging
import lzma
import math
import struct
import sys
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from json import JSONDecodeError

from pydantic import ValidationError
from zstandard import ZstdError

import stereocell.storage.location as location
from stereocell.model.errors import SourceError, StereoCellError
from stereocell.storage.first_bytes import HEAD_BYTES, identify
from stereocell.storage.processes import address_limit, shortage

# Seen with truncated and garbled files of every codec: zarr and numpy raise ValueError, TypeError
# and KeyError; numcodecs and imagecodecs RuntimeError; gzip EOFError and zlib.error; tifffile
# ValueError, and struct.error for a truncated header. Metadata of another form than the format's
# raise AttributeError, sizes beyond this machine MemoryError, OverflowError and SystemError.
_FAULTS = (
    OSError,
    EOFError,
    ValueError,
    TypeError,
    LookupError,
    RuntimeError,
    AttributeError,
    ArithmeticError,
    MemoryError,
    SystemError,
    struct.error,
    zlib.error,
    lzma.LZMAError,
    ZstdError,
)
# Classes of libraries that take long to import: an error of theirs is raised once they are there
_NO_NODE = ("zarr.errors", "NodeNotFoundError")
_LATE = (
    ("aiohttp", "ClientError"),
    ("botocore.exceptions", "BotoCoreError"),
    ("nrrd.errors", "NRRDError"),
    ("xml.etree.ElementTree", "ParseError"),  # a SyntaxError; liffile lets it pass
    _NO_NODE,
)


def _faults() -> tuple[type[BaseException], ...]:
    """Return the caught classes, of the slow libraries those that are imported already."""
    late = (_imported(module, name) for module, name in _LATE)
    return (*_FAULTS, *(found for found in late if found is not None))


def _imported(module: str, name: str) -> type[BaseException] | None:
    """Return a library's class of errors, or None where the library is not imported."""
    return getattr(sys.modules.get(module), name, None)


@contextmanager
def one_line(
    where: str, expected: str, *, raised: type[StereoCellError] = SourceError
) -> Iterator[None]:
    """Turn an error of a library inside the block into `raised` with a text of one line.

    expected  the expected state of the source, for the text

    Only calls into format libraries belong inside: the caught classes are broad.
    """
    try:
        yield
    except StereoCellError:
        raise
    except _faults() as error:
        raise_if_short(error, where, raised=raised)
        raise raised(f"{where}: {_reason(error)}; expected {expected}") from error


def raise_if_short(
    error: BaseException, where: str, *, raised: type[StereoCellError] = SourceError
) -> None:
    """Raise `raised` with one line where a library's error comes from a lack of memory here.

    Without a limit of address space a MemoryError comes from the file, which may state any size.
    """
    is_ours = not isinstance(error, MemoryError) or address_limit() < math.inf
    if is_ours and (words := shortage(error)):
        raise raised(f"{where}: {words}") from error


def _reason(error: BaseException) -> str:
    if isinstance(error, ValidationError):
        first = error.errors()[0]
        field = ".".join(str(step) for step in first["loc"])
        return f"field {field}: found {first['input']!r:.60}, {first['msg'].lower()}"
    no_node = _imported(*_NO_NODE)
    if no_node is not None and isinstance(error, no_node):
        return "zarr.json, .zgroup or .zarray: not found, or not reachable"
    if isinstance(error, FileNotFoundError):
        return "not found, or not reachable"
    if isinstance(error, KeyError):
        return f"field {error} is missing"
    if isinstance(error, AttributeError):
        return f"metadata of another form ({_shortened(str(error))})"
    if isinstance(error, MemoryError | OverflowError | SystemError):
        return "it asks for more memory than there can be"
    if isinstance(error, RecursionError):
        return "metadata: nested too deeply"
    if isinstance(error, JSONDecodeError):
        content = identify(error.doc.encode("utf-8", "replace")[:HEAD_BYTES])
        is_json = not content.is_known or content.words.startswith(("JSON", "a text file"))
        return f"metadata: {error}" if is_json else f"metadata: found {content.words}"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    if isinstance(error, TimeoutError):  # aiohttp's text is longer for silence than for other waits
        is_silence = bool(str(error))
        return f"did not answer {f'within {location.SILENCE_S:g} s' if is_silence else 'in time'}"
    return _shortened(str(error)) or type(error).__name__


def _shortened(text: str) -> str:
    text = " ".join(text.split())
    return text if len(text) <= 160 else text[:157] + "..."


class _Collector(logging.Filter):
    def __init__(self) -> None:
        super().__init__()
        self.messages: list[str] = []

    def filter(self, record: logging.LogRecord) -> bool:
        self.messages.append(record.getMessage())
        return False


@contextmanager
def collected_log(logger_name: str) -> Iterator[list[str]]:
    """Hide a library's log lines from the user inside the block; yield their list."""
    collector = _Collector()
    logger = logging.getLogger(logger_name)
    logger.addFilter(collector)
    try:
        yield collector.messages
    finally:
        logger.removeFilter(collector)


@contextmanager
def without_warning(message: str, category: type[Warning]) -> Iterator[None]:
    """Silence one known warning of a library; `message` is a regular expression of its start."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=message, category=category)
        yield
