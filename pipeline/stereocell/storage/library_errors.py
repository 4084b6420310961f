"""Turn errors of format libraries on damaged, unusual or unreachable sources into one line.

On a damaged file a library can raise any exception: tifffile an AssertionError, a parser a
RecursionError. So every exception that a library raised becomes one line. StereoCell's code around
such a call parses values of the file, too. Its exceptions become one line if their class is in
_FAULTS. All other exceptions are bugs and keep their traceback.

`one_line` surrounds calls of one library, and quotes its text. `library_boundary` surrounds a whole
reader as the last resort. It catches only exceptions that were raised inside a library, and quotes
no text, which could hold a patient's name. Both keep warnings of libraries from the terminal
(library_noise.py). A library that can end its process runs in a child process (child_process.py),
and `one_line` turns the child's death into a line, too.
"""

import logging
import lzma
import math
import re
import struct
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from json import JSONDecodeError
from pathlib import Path
from types import FrameType
from xml.etree.ElementTree import ParseError

from pydantic import ValidationError
from zstandard import ZstdError

import stereocell.storage.location as location
from stereocell.model.errors import SourceError, StereoCellError
from stereocell.storage.child_process import ChildError
from stereocell.storage.first_bytes import HEAD_BYTES, identify
from stereocell.storage.library_noise import quiet_libraries
from stereocell.storage.processes import address_limit, shortage

_PACKAGE = Path(__file__).parents[1]
_AGAIN = "copy or download it again"
_REMEDY = f": it may be damaged, {_AGAIN}"
# Classes of errors that a damaged file causes in StereoCell's own parsing, or in C code, which has
# no frame:
# - ValueError, TypeError and RuntimeError in numpy and numcodecs
# - zlib.error and EOFError for packed bytes that end early, struct.error for a short header
# - AttributeError for metadata of another form, ParseError for XML
# - MemoryError, OverflowError and SystemError for sizes that exceed this machine
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
    ParseError,
)


class DamagedError(ValueError):
    """A decoder can't decode a part of a source. The text names the part and the reason."""


# Classes of decoders' errors, and the modules that raise them: such an error means damaged bytes.
# Most of these libraries decode several formats, so the formats' own rows do not list them. An
# OSError with an errno comes from the system and does not mean damage.
_UNDECODED = (DamagedError, zlib.error, lzma.LZMAError, ZstdError, EOFError, struct.error)
_DECODERS = re.compile(
    r"imagecodecs\b.*|numcodecs\.(?!registry|errors).*|zarr\.codecs\.crc32c_|pyarrow\b.*|gzip|bz2|lzma"
    r"|h5py\.(h5d|_selector)"
)


@contextmanager
def one_line(
    where: str, expected: str, *, raised: type[StereoCellError] = SourceError
) -> Iterator[None]:
    """Turn an error of a library inside the block into an error of one line.

    where     file or address, for the text
    expected  expected state of the source, for the text
    raised    class of the error

    Only calls of format libraries belong inside, because the caught classes are broad.
    """
    try:
        with quiet_libraries():
            yield
    except ChildError as error:
        raise raised(f"{where}: {error} while it was read, expected {expected}{_REMEDY}") from None
    except StereoCellError:
        raise
    except Exception as error:
        if not isinstance(error, _FAULTS) and not _library_of(error):
            raise
        raise_if_short(error, where, raised=raised)
        if is_undecoded(error):
            raise raised(
                f"{where}: {damage_words(error)}, expected {expected}: {_AGAIN}"
            ) from error
        raise raised(f"{where}: {_reason(error)}, expected {expected}{_remedy(error)}") from error


@contextmanager
def library_boundary(where: str, expected: str) -> Iterator[None]:
    """Turn an error that a library raised inside the block into a SourceError of one line.

    where     file or address, for the text
    expected  expected state of the source, for the text

    Errors of StereoCell's own code are not caught: they are bugs, or lines for the user already.
    """
    try:
        with quiet_libraries():
            yield
    except StereoCellError:
        raise
    except Exception as error:
        if not (library := _library_of(error)):
            raise
        raise_if_short(error, where)
        raise SourceError(
            f"{where}: {library} failed on its content ({type(error).__name__}), expected "
            f"{expected}{_REMEDY}"
        ) from error


def is_undecoded(error: BaseException) -> bool:
    """Return whether a decoder raised the error because the bytes can't be decoded."""
    if isinstance(error, _UNDECODED):
        return True
    if not isinstance(error, ValueError | RuntimeError | OSError) or getattr(error, "errno", None):
        return False
    if isinstance(error, NotImplementedError | RecursionError | UnicodeError):
        return False
    trace, module = error.__traceback__, ""
    while trace is not None:
        module, trace = str(trace.tb_frame.f_globals.get("__name__", "")), trace.tb_next
    return any(_DECODERS.fullmatch(name) for name in (module, type(error).__module__))


def damage_words(error: BaseException) -> str:
    """Return words for a source that a decoder failed on, with the decoder's own text."""
    if isinstance(error, DamagedError):
        return str(error)
    return f"damaged (the library says: {_shortened(str(error) or type(error).__name__)})"


def _library_of(error: BaseException) -> str:
    """Return the library that raised the error; empty: StereoCell's own code raised it."""
    frames: list[FrameType] = []
    trace = error.__traceback__
    while trace is not None:
        frames.append(trace.tb_frame)
        trace = trace.tb_next
    called = ""
    for frame in reversed(frames):
        if _PACKAGE in Path(frame.f_code.co_filename).parents:
            break
        called = str(frame.f_globals.get("__name__", "a library")).partition(".")[0]
    return called


def raise_if_short(
    error: BaseException, where: str, *, raised: type[StereoCellError] = SourceError
) -> None:
    """Raise an error of one line if a library's error comes from a lack of memory.

    Without a limit of address space a MemoryError does not count, because it comes from the file,
    which may state any size.
    """
    is_ours = not isinstance(error, MemoryError) or address_limit() < math.inf
    if is_ours and (words := shortage(error)):
        raise raised(f"{where}: {words}") from error


def _reason(error: BaseException) -> str:
    if isinstance(error, ValidationError):
        first = error.errors()[0]
        field = ".".join(str(step) for step in first["loc"])
        return f"field {field}: found {first['input']!r:.60}, {first['msg'].lower()}"
    if isinstance(error, FileNotFoundError):
        return "not found, or not reachable"
    if isinstance(error, KeyError):
        return f"field {error} is missing"
    if isinstance(error, AttributeError):
        return f"metadata of another form ({_shortened(str(error))})"
    if isinstance(error, MemoryError | OverflowError | SystemError):
        return "it states a size that no memory can hold"
    if isinstance(error, RecursionError):
        return "metadata: nested too deeply"
    if isinstance(error, JSONDecodeError):
        content = identify(error.doc.encode("utf-8", "replace")[:HEAD_BYTES])
        is_json = not content.is_known or content.words.startswith(("JSON", "a text file"))
        return f"metadata: {error}" if is_json else f"metadata: found {content.words}"
    if isinstance(error, OSError) and error.strerror:
        return error.strerror
    if _needs_ranges(error):
        return "the host does not send parts of files"
    if isinstance(error, TimeoutError):  # aiohttp's error has a text only for a silent host
        is_silence = bool(str(error))
        return f"did not answer {f'within {location.SILENCE_S:g} s' if is_silence else 'in time'}"
    if not str(error):
        return f"its content can't be decoded ({_library_of(error)} raised {type(error).__name__})"
    return _shortened(str(error))


def _remedy(error: BaseException) -> str:
    """Return the remedy for a library's error, after a colon; empty: none is known."""
    if _needs_ranges(error):
        return ": ask its operator to turn on range requests, or download the file first"
    return ""


def _needs_ranges(error: BaseException) -> bool:
    return "support range requests" in str(error)  # fsspec's text is for programmers


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
    """Inside the block, hide a library's log lines from the user. Yield the list of them."""
    collector = _Collector()
    logger = logging.getLogger(logger_name)
    logger.addFilter(collector)
    try:
        yield collector.messages
    finally:
        logger.removeFilter(collector)


@contextmanager
def without_warning(message: str, category: type[Warning]) -> Iterator[None]:
    """Inside the block, silence one known warning of a library.

    message  regular expression for the start of its text
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=message, category=category)
        yield
