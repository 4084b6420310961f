"""Exceptions of a library over a damaged file become one line; bugs of our own keep theirs."""

import struct
import traceback
from collections.abc import Callable
from pathlib import Path

import pytest

from stereocell.model.errors import SourceError
from stereocell.storage import library_errors
from stereocell.storage.library_errors import library_boundary, one_line

CLASSES = (
    AssertionError("a length of 3"),
    AssertionError(),
    OverflowError("int too large to convert to float"),
    RecursionError("maximum recursion depth exceeded"),
    MemoryError(),
    struct.error("unpack requires a buffer of 4 bytes"),
    UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid start byte"),
    ZeroDivisionError("division by zero"),
    IndexError("list index out of range"),
    StopIteration(),
    BufferError("memoryview"),
    Exception("of a class of its own"),
    NotImplementedError(),
)


def raised_in_the_package(error: Exception) -> None:
    """Raise an exception as a bug of our own would: from a file of the package."""
    file = Path(library_errors.__file__).with_name("a_bug.py")
    code = compile("def bug(error):\n    raise error\n", str(file), "exec")
    names: dict[str, Callable[[Exception], None]] = {}
    exec(code, names)
    names["bug"](error)


def raised_in_a_library(error: Exception) -> None:
    raise error


@pytest.mark.parametrize("error", CLASSES, ids=repr)
def test_an_exception_of_any_class_that_a_library_raises_becomes_one_line(error: Exception) -> None:
    for boundary in (one_line, library_boundary):
        with pytest.raises(SourceError) as caught, boundary("a.tif", "a TIFF file, whole"):
            raised_in_a_library(error)
        line = str(caught.value)
        assert line.startswith("a.tif: ")
        assert "expected a TIFF file, whole" in line
        assert "\n" not in line
        assert caught.value.__cause__ is error


@pytest.mark.parametrize("boundary", [one_line, library_boundary])
@pytest.mark.parametrize(
    "error", [AssertionError("ours"), NameError("ours"), StopIteration("ours")]
)
def test_a_bug_of_our_own_keeps_its_traceback(boundary: Callable, error: Exception) -> None:
    with pytest.raises(type(error)) as caught, boundary("a.tif", "a TIFF file, whole"):
        raised_in_the_package(error)
    assert caught.value is error
    assert traceback.extract_tb(error.__traceback__)[-1].name == "bug"


def test_the_boundary_of_a_reader_takes_no_error_of_our_own_parsing_for_the_librarys() -> None:
    with pytest.raises(ValueError, match="ours"), library_boundary("a.tif", "a TIFF file, whole"):
        raised_in_the_package(ValueError("ours"))


def test_the_boundary_of_a_reader_quotes_no_text_of_the_library() -> None:
    with pytest.raises(SourceError) as caught, library_boundary("a.dcm", "DICOM that is whole"):
        raised_in_a_library(ValueError("PatientName is Jane Doe"))
    assert "Jane" not in str(caught.value)
    assert "(ValueError)" in str(caught.value)
