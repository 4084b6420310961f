"""A field that a file states twice with different values gives one note, and one value is used."""

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import tifffile
import zarr

from stereocell import read
from stereocell.read.repeats import collected, load_json

VOXELS = np.arange(4 * 8 * 8, dtype=np.uint16).reshape(4, 8, 8)
AXES = [{"name": name, "type": "space", "unit": "micrometer"} for name in "zyx"]


def multiscales(scale: list[float]) -> list[Any]:
    transform = [{"type": "scale", "scale": scale}]
    return [{"axes": AXES, "version": "0.4",
             "datasets": [{"path": "0", "coordinateTransformations": transform}]}]  # fmt: skip


def write_zarr(folder: Path, version: int) -> Path:
    group = zarr.create_group(folder, zarr_format=version)
    group.create_array("0", data=VOXELS, chunks=(4, 8, 8))
    attributes: dict[str, Any] = {"multiscales": multiscales([2, 1, 1])}
    group.attrs.update(attributes if version == 2 else {"ome": {**attributes, "version": "0.5"}})
    return folder / (".zattrs" if version == 2 else "zarr.json")


def repeat(file: Path, key: str, earlier: Any) -> None:
    """Repeat a key of a JSON file before its first place, with another value."""
    text = file.read_text("utf-8")
    before = f'"{key}": {json.dumps(earlier)}, '
    assert f'"{key}":' in text
    file.write_text(text.replace(f'"{key}":', f'{before}"{key}":', 1), "utf-8")


@pytest.mark.parametrize("version", [2, 3])
def test_a_key_of_zarr_that_is_stated_twice_is_one_note(tmp_path: Path, version: int) -> None:
    file = write_zarr(tmp_path / "a.zarr", version)
    repeat(file, "multiscales", multiscales([9, 1, 1]))
    dataset = read.open(tmp_path / "a.zarr")
    assert dataset.levels[0].spacing_um == (2, 1, 1)  # json, and so zarr, reads this value
    (note,) = [one for one in dataset.notes if "multiscales" in one]
    assert f"key multiscales of {file.name}, which is there 2 times" in note
    assert "its last value is used" in note


def test_an_array_of_zarr_is_checked_too(tmp_path: Path) -> None:
    write_zarr(tmp_path / "a.zarr", 2)
    repeat(tmp_path / "a.zarr" / "0" / ".zarray", "fill_value", 7)
    notes = read.open(tmp_path / "a.zarr").notes
    assert sum("key fill_value of 0/.zarray" in note for note in notes) == 1


def test_a_key_that_is_stated_twice_with_one_value_needs_no_note(tmp_path: Path) -> None:
    file = write_zarr(tmp_path / "a.zarr", 2)
    repeat(file, "multiscales", multiscales([2, 1, 1]))
    assert not any("multiscales" in one for one in read.open(tmp_path / "a.zarr").notes)


@pytest.mark.slow
def test_keys_of_n5_and_of_vigra_are_checked(tmp_path: Path) -> None:
    folder = tmp_path / "a.n5" / "s0"
    (folder / "0" / "0").mkdir(parents=True)
    header = np.array([0, 3], ">u2").tobytes() + np.array([8, 8, 4], ">u4").tobytes()
    (folder / "0" / "0" / "0").write_bytes(header + VOXELS.astype(">u2").tobytes())
    (folder / "attributes.json").write_text(
        '{"dimensions": [8, 8, 4], "blockSize": [8, 8, 4], "dataType": "uint16", "compression": '
        '{"type": "raw"}, "resolution": [1, 1, 9], "resolution": [1, 1, 2], "units": '
        '["um", "um", "um"]}',
        "utf-8",
    )
    notes = read.open(folder).notes
    assert sum("key resolution of attributes.json" in note for note in notes) == 1

    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["v"] = VOXELS
        file["v"].attrs["axistags"] = (
            '{"axes": [{"key": "z", "key": "q"}, {"key": "y"}, {"key": "x"}], "axes": '
            '[{"key": "z", "resolution": 2}, {"key": "y"}, {"key": "x"}]}'
        )
    notes = read.open(tmp_path / "a.h5", spacing_um=(2, 1, 1)).notes
    assert sum("of axistags, which is there 2 times" in note for note in notes) == 2


def ome_xml(pixels: str) -> str:
    return (
        '<?xml version="1.0"?><OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06">'
        f'<Image ID="Image:0">{pixels}</Image></OME>'
    )


def pixels_with(z: float, more: str = "") -> str:
    return (
        f'<Pixels ID="Pixels:0" DimensionOrder="XYZCT" Type="uint16" SizeX="8" SizeY="8" '
        f'SizeZ="4" SizeC="1" SizeT="1" PhysicalSizeX="1" PhysicalSizeY="1" PhysicalSizeZ="{z}">'
        f'<Channel ID="Channel:0:0" SamplesPerPixel="1"/><TiffData/>{more}</Pixels>'
    )


PLANES = '<Plane TheZ="0" TheC="0" TheT="0" PositionZ="{}"/>'


@pytest.mark.parametrize(
    ("pixels", "words"),
    [
        (pixels_with(2) + pixels_with(9), "element Pixels in Image"),
        (pixels_with(2, PLANES.format(0) + PLANES.format(5)), "element Plane in Pixels"),
        (pixels_with(2, '<Channel ID="Channel:0:0" Name="B"/>'), "element Channel in Pixels"),
    ],
)
def test_a_repeated_element_of_ome_xml_is_one_note(tmp_path: Path, pixels: str, words: str) -> None:
    path = tmp_path / "a.ome.tif"
    tifffile.imwrite(
        path, VOXELS, description=ome_xml(pixels), metadata=None, photometric="minisblack"
    )
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == (2, 1, 1)
    (note,) = [one for one in dataset.notes if words in one]
    assert "the OME-XML of a.ome.tif" in note
    assert "the first one is used" in note


def test_nothing_is_recorded_outside_a_collection() -> None:
    assert load_json('{"a": 1, "a": 2}', "x") == {"a": 2}
    with collected() as notes:
        assert load_json('{"a": [1, 2], "a": [1, 3], "b": 1, "b": 1}', "x") == {"a": [1, 3], "b": 1}
    assert list(notes) == [("x", "key a")]
