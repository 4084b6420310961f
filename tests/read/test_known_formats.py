"""Everything that is known about a format is in its own row, and nowhere else."""

import struct
import subprocess
import sys
from itertools import combinations
from pathlib import Path

import pytest

import stereocell
from stereocell.model.errors import SourceError
from stereocell.read import extras, list_series
from stereocell.read import open as open_source
from stereocell.read.known_formats import format_of, identify, known_formats

PACKAGE = Path(stereocell.__file__).parent
# libraries of formats; zarr and tifffile alone take longer to import than all rows together
LIBRARIES = {
    *("h5py", "imagecodecs", "liffile", "mrcfile", "nd2", "nibabel", "nrrd", "PIL", "pydicom"),
    *("scipy", "tifffile", "zarr"),
}
TIFF = b"II*\0" + bytes(508)


def put(head: bytes, place: int, mark: bytes) -> bytes:
    return head[:place] + mark + head[place + len(mark) :]


def test_every_module_of_formats_holds_a_row() -> None:
    formats = known_formats()
    assert len(formats) >= 17
    assert list(formats) == sorted(formats, key=lambda name: name.replace("-", "_"))
    assert all(one.guides for one in formats.values() if one.name != "other")


def test_no_ending_belongs_to_two_formats() -> None:
    rows = known_formats().values()
    endings = [{*one.endings, *one.loose_endings, *one.folder_endings} for one in rows]
    assert not [a & b for a, b in combinations(endings, 2) if a & b]


@pytest.mark.slow
def test_rows_import_no_library_of_a_format() -> None:
    code = "import sys, stereocell.read.known_formats as k; k.known_formats(); print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not LIBRARIES & set(loaded)
    assert "stereocell.read.formats.tiff" in loaded


def test_storage_names_no_ending_of_a_format() -> None:
    texts = {file: file.read_text("utf-8") for file in (PACKAGE / "storage").glob("*.py")}
    for one in known_formats().values():
        for ending in {*one.endings, *one.loose_endings, *one.folder_endings}:
            found = [file.name for file, text in texts.items() if f'"{ending}"' in text]
            assert not found, ending


@pytest.mark.parametrize(
    ("head", "name"),
    [
        (put(TIFF, 208, b"MAP "), "tiff"),
        (put(TIFF, 128, b"DICM"), "dicom"),
        (put(bytes(512), 208, b"MAP "), "mrc"),
        (put(put(bytes(512), 344, b"n+1\0"), 208, b"MAP "), "nifti"),
        (b"NRRD0005\n# " + put(bytes(512), 208 - 11, b"MAP "), "nrrd"),
    ],
)
def test_a_mark_counts_before_one_in_the_free_text_of_a_header(head: bytes, name: str) -> None:
    assert identify(head).format == name


@pytest.mark.parametrize("source", ["a.tif/0", "a.tif:/raw", "a.tif/x/y.tif", "gone.h5:/raw"])
def test_a_part_of_a_file_is_not_found_in_a_format_without_parts(
    tmp_path: Path, source: str
) -> None:
    (tmp_path / "a.tif").write_bytes(b"II*\0" + struct.pack("<I", 8) + bytes(64))
    with pytest.raises(SourceError, match=": not found, expected a file or a folder"):
        open_source(f"{tmp_path}/{source}")


@pytest.mark.parametrize("name", ["a:b.tif", "a.h5:/x.tif"])
def test_a_file_whose_name_looks_like_a_part_is_a_file(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(TIFF)
    assert format_of(path).name == "tiff"
    with pytest.raises(SourceError, match="TIFF"):
        open_source(path)


@pytest.mark.parametrize(
    ("name", "head", "extra"),
    [
        ("a.czi", b"ZISRAWFILE", "czi"),
        ("a.lif", b"\x70\0\0\0\1\1\1\1\x2a", "lif"),
        ("a.nd2", b"\xda\xce\xbe\x0a", "nd2"),
    ],
)
def test_a_missing_library_is_named_with_the_command_that_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, head: bytes, extra: str
) -> None:
    (tmp_path / name).write_bytes(head + bytes(600))
    monkeypatch.setattr(extras, "find_spec", lambda library: None)
    for act in (open_source, list_series):
        with pytest.raises(
            SourceError, match=rf'expected the extra {extra}: pip install "stereocell\[{extra}\]"'
        ):
            act(tmp_path / name)
