"""Exceptions of libraries on damaged files become one line; bugs keep their traceback."""

import gzip
import io
import lzma
import struct
import traceback
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import imagecodecs
import numcodecs
import numpy as np
import pytest
import zstandard

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
    """Raise an exception from a file of the package, as a bug of StereoCell would."""
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


def fail_in_imagecodecs() -> None:
    imagecodecs.deflate_decode(imagecodecs.deflate_encode(bytes(4000)), out=10)


def fail_in_numcodecs() -> None:
    numcodecs.Blosc().decode(bytes(range(40)))


def fail_in_h5py() -> None:
    with h5py.File(io.BytesIO(), "w") as file:
        voxels = file.create_dataset("a", data=np.arange(4000), chunks=(4000,), compression="gzip")
        voxels.id.write_direct_chunk((0,), b"no stream")
        voxels[:]


DECODERS: list[Callable[[], object]] = [
    fail_in_imagecodecs,
    fail_in_numcodecs,
    fail_in_h5py,
    lambda: zlib.decompress(b"no stream"),
    lambda: gzip.decompress(gzip.compress(b"a" * 99)[:-9]),
    lambda: lzma.decompress(b"no stream"),
    lambda: zstandard.ZstdDecompressor().decompress(b"no stream"),
    lambda: struct.unpack("<I", b"abc"),
]


@pytest.mark.parametrize("decode", DECODERS)
def test_bytes_that_a_decoder_refuses_are_reported_as_damaged_with_a_remedy(
    decode: Callable[[], object],
) -> None:
    with pytest.raises(SourceError) as caught, one_line("a.tif", "pages that are whole"):
        decode()
    line = str(caught.value)
    assert line.startswith("a.tif: damaged (the library says: ")
    assert line.endswith("), expected pages that are whole: copy or download it again")


@pytest.mark.parametrize(
    "fail",
    [
        lambda: numcodecs.get_codec({"id": "nobody's"}),
        lambda: h5py.File("/nowhere/a.h5"),
        Path("/nowhere/a.h5").read_bytes,
        lambda: raised_in_a_library(ValueError("an unknown kind of axis")),
    ],
)
def test_other_errors_of_libraries_are_not_called_damage(fail: Callable[[], object]) -> None:
    with pytest.raises(SourceError) as caught, one_line("a.tif", "pages that are whole"):
        fail()
    assert "damaged" not in str(caught.value)


@pytest.mark.parametrize("boundary", [one_line, library_boundary])
@pytest.mark.parametrize(
    "error", [AssertionError("ours"), NameError("ours"), StopIteration("ours")]
)
def test_a_bug_of_stereocell_keeps_its_traceback(boundary: Callable, error: Exception) -> None:
    with pytest.raises(type(error)) as caught, boundary("a.tif", "a TIFF file, whole"):
        raised_in_the_package(error)
    assert caught.value is error
    assert traceback.extract_tb(error.__traceback__)[-1].name == "bug"


def test_the_boundary_of_a_reader_does_not_catch_errors_of_stereocell_s_parsing() -> None:
    with pytest.raises(ValueError, match="ours"), library_boundary("a.tif", "a TIFF file, whole"):
        raised_in_the_package(ValueError("ours"))


def test_the_boundary_of_a_reader_quotes_no_text_of_the_library() -> None:
    with (
        pytest.raises(SourceError) as caught,
        library_boundary("a.dcm", "a complete source (DICOM)"),
    ):
        raised_in_a_library(ValueError("PatientName is Jane Doe"))
    assert "Jane" not in str(caught.value)
    assert "(ValueError)" in str(caught.value)
