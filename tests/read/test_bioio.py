"""Formats that bioio reads. A stand-in is installed here, since bioio is not a dependency."""

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import dask.array
import numpy as np
import pytest

from stereocell import read
from stereocell.model.errors import SourceError
from stereocell.model.tiling import Box
from support.phantoms import f_phantom


class Unsupported(Exception):
    """Like bioio_base.exceptions.UnsupportedFileFormatError, which has no other base class."""


class Nanometer:
    """Like a unit of pint: its text is its name."""

    def __str__(self) -> str:
        return "nanometer"


class BioImage:
    """The part of bioio.BioImage that is used."""

    scenes = ("Jane", "Joe")
    channel_names = ("DAPI", "Channel:0:1")
    physical_pixel_sizes = SimpleNamespace(Z=0.5, Y=0.2, X=0.25)

    def __init__(self, path: str) -> None:
        if not path.endswith(".dv"):
            raise Unsupported
        if Path(path).read_bytes() != b"DV":
            raise ValueError("no DV\nat all")
        self.set_scene(0)

    def set_scene(self, index: int) -> None:
        body = f_phantom()[: 9 if index == 0 else 16]
        stored = np.stack([body, body + 1])[None]
        self.dask_data = dask.array.from_array(stored, (1, 1, 1, 48, 36))
        self.dims = SimpleNamespace(order="TCZYX", T=1, C=2, Z=len(body), Y=48, X=36)


@pytest.fixture
def _bioio(monkeypatch: pytest.MonkeyPatch) -> None:
    bioio, base = ModuleType("bioio"), ModuleType("bioio_base")
    exceptions: Any = ModuleType("bioio_base.exceptions")
    bioio.BioImage = BioImage  # type: ignore[attr-defined]
    bioio.__spec__ = SimpleNamespace()  # type: ignore[assignment]
    exceptions.UnsupportedFileFormatError = Unsupported
    for module in (bioio, base, exceptions):
        monkeypatch.setitem(sys.modules, module.__name__, module)


@pytest.mark.usefixtures("_bioio")
@pytest.mark.slow
def test_a_plugin_s_format_is_read_with_its_scenes(tmp_path: Path) -> None:
    (tmp_path / "a b.dv").write_bytes(b"DV")
    dataset = read.open(tmp_path / "a b.dv")
    assert dataset.levels[0].spacing_um == (0.5, 0.2, 0.25)
    assert [channel.name for channel in dataset.channels] == ["DAPI", "Channel1"]
    assert dataset.notes[0] == "read by bioio"
    assert "2 images; building --series 2" in dataset.notes[1]
    box = Box((1, 7, 3), (9, 30, 20))
    np.testing.assert_array_equal(dataset.read(1, box).voxels, f_phantom()[box.slices] + 1)
    assert read.open(tmp_path / "a b.dv", series=1).levels[0].shape == (9, 48, 36)
    assert "Jane" not in "".join(read.list_series(tmp_path / "a b.dv"))
    assert dataset.notes[-1].startswith("unit of the voxel size: not stated, um is assumed")


@pytest.mark.usefixtures("_bioio")
def test_a_plugin_s_units_and_both_sizes_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in bioio-base since 3.0: units of pint, and a scale beside the sizes."""
    unit = SimpleNamespace(unit=Nanometer())
    units, scale = SimpleNamespace(Z=unit, Y=unit, X=unit), SimpleNamespace(Z=500, Y=200, X=300)
    sizes = SimpleNamespace(Z=500.0, Y=200.0, X=250.0)
    for name, value in (("physical_pixel_sizes", sizes), ("scale", scale)):
        monkeypatch.setattr(BioImage, name, value, raising=False)
    monkeypatch.setattr(BioImage, "dimension_properties", units, raising=False)
    (tmp_path / "a.dv").write_bytes(b"DV")
    dataset = read.open(tmp_path / "a.dv")
    assert dataset.levels[0].spacing_um == pytest.approx((0.5, 0.2, 0.25))
    assert dataset.notes[-1] == (
        "voxel spacing along x: physical_pixel_sizes states 0.25 um, scale states 0.3 um: "
        "physical_pixel_sizes is used; --spacing-um z,y,x replaces it"
    )
    assert not [note for note in dataset.notes if note.startswith("unit ")]


@pytest.mark.usefixtures("_bioio")
def test_a_negative_voxel_size_is_noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(BioImage, "physical_pixel_sizes", SimpleNamespace(Z=0.5, Y=-0.2, X=0.25))
    (tmp_path / "a.dv").write_bytes(b"DV")
    dataset = read.open(tmp_path / "a.dv")
    assert dataset.levels[0].spacing_um == (0.5, 0.2, 0.25)
    assert [note for note in dataset.notes if note.startswith("voxel size along y: found -0.2 um")]


@pytest.mark.usefixtures("_bioio")
def test_a_file_that_no_plugin_reads_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "a.dv").write_bytes(b"other")
    (tmp_path / "a.xyz").write_bytes(b"other")
    with pytest.raises(SourceError, match="no DV at all, expected a file that a plugin"):
        read.open(tmp_path / "a.dv")
    with pytest.raises(
        SourceError,
        match=r"unknown format: found .*, expected .* or a file for an installed plugin of bioio",
    ):
        read.open(tmp_path / "a.xyz")


def test_without_bioio_the_message_names_it(tmp_path: Path) -> None:
    (tmp_path / "a.dv").write_bytes(b"DV")
    with pytest.raises(
        SourceError,
        match=r"unknown format: found .*, expected .* or a file for an installed plugin of bioio",
    ):
        read.open(tmp_path / "a.dv")
