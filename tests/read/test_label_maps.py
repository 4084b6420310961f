"""Label maps in their files' own form: numbers of any kind, names, colours and columns."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pytest
import tifffile
import zarr

from stereocell import read
from stereocell.model.color import linear_color
from stereocell.model.errors import SourceError
from stereocell.read.label_map import LabelMap
from stereocell.read.label_notes import notes_of_ngff, notes_of_nifti

TABLE = (
    b'<?xml version="1.0"?><CaretExtension><VolumeInformation><LabelTable>'
    b'<Label Key="0" Red="0" Green="0" Blue="0">none</Label>'
    b'<Label Key="1" Red="1" Green="0.5" Blue="0" Alpha="1">spleen</Label>'
    b'<Label Key="2">kidney  right\x00</Label><Label Key="x">no number</Label>'
    b"</LabelTable></VolumeInformation></CaretExtension>"
)


def labels_of(path: Path) -> LabelMap:
    return LabelMap(read.open(path, spacing_um=(1.0, 1.0, 1.0)), 0)


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint32", "int64", "uint64", "float32"])
def test_numbers_of_any_kind_are_the_stored_ones(tmp_path: Path, dtype: str) -> None:
    top = {"uint64": 2**64 - 1, "int64": 2**63 - 1, "uint32": 2**32 - 1}.get(dtype, 200)
    stored = np.array([0, 1, 7, top], dtype)[np.arange(210).reshape(5, 6, 7) % 4]
    tifffile.imwrite(tmp_path / "l.tif", stored, metadata={"axes": "ZYX"})
    labels = labels_of(tmp_path / "l.tif")
    found = labels.read(labels.dataset.levels[0].box)
    assert found.dtype.kind == "u"
    assert found.tolist() == stored.astype(np.uint64).tolist()


@pytest.mark.parametrize("dtype", ["int8", "int32", "float64"])
def test_minus_one_and_nan_mean_no_object(tmp_path: Path, dtype: str) -> None:
    stored = np.full((5, 6, 7), 5, dtype)
    stored[0, 0, 0] = -1
    if dtype == "float64":
        stored[1, 0, 0] = np.nan
    tifffile.imwrite(tmp_path / "l.tif", stored, metadata={"axes": "ZYX"})
    labels = labels_of(tmp_path / "l.tif")
    found = labels.read(labels.dataset.levels[0].box)
    assert found[0, 0, 0] == 0
    assert np.unique(found).tolist() == [0, 5]


@pytest.mark.parametrize("dtype", ["int8", "int32", "int64", "float32"])
def test_a_background_below_0_means_no_object_if_the_user_names_it(
    tmp_path: Path, dtype: str
) -> None:
    least = -128 if dtype == "int8" else -(2**31)
    stored = np.array([least, 1, 7, -1], dtype)[np.arange(210).reshape(5, 6, 7) % 4]
    tifffile.imwrite(tmp_path / "l.tif", stored, metadata={"axes": "ZYX"})
    labels = labels_of(tmp_path / "l.tif")
    box = labels.dataset.levels[0].box
    found = replace(labels, background=least).read(box)
    assert found.tolist() == np.where(stored < 0, 0, stored).astype(int).tolist()
    with pytest.raises(
        SourceError, match=f"found {least}, .*: give --background {least} if it marks"
    ):
        labels.read(box)
    with pytest.raises(SourceError, match=f"found {least}"):
        replace(labels, background=-(2**53)).read(box)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_numbers_that_a_float_can_t_distinguish_are_refused_with_the_reason(
    tmp_path: Path, dtype: str
) -> None:
    stored = np.full((5, 6, 7), 2.0**53 + 2, dtype)
    tifffile.imwrite(tmp_path / "l.tif", stored, metadata={"axes": "ZYX"})
    labels = labels_of(tmp_path / "l.tif")
    expected = rf"found 900719925474099[24] in {dtype}, which rounds whole numbers .* int64"
    with pytest.raises(SourceError, match=expected):
        labels.read(labels.dataset.levels[0].box)


@pytest.mark.parametrize(
    ("value", "expected"), [(-2, "found -2"), (0.5, "found 0.5"), (np.inf, "inf")]
)
def test_other_numbers_are_refused_as_labels(tmp_path: Path, value: float, expected: str) -> None:
    stored = np.full((5, 6, 7), 5, np.float32)
    stored[1, 1, 1] = value
    tifffile.imwrite(tmp_path / "l.tif", stored, metadata={"axes": "ZYX"})
    labels = labels_of(tmp_path / "l.tif")
    with pytest.raises(SourceError, match=expected):
        labels.read(labels.dataset.levels[0].box)


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_colours_and_columns_of_ngff_are_read(tmp_path: Path, version: str) -> None:
    about: dict[str, Any] = {
        "version": version,
        "colors": [{"label-value": 3, "rgba": [255, 0, 128, 255]}, {"label-value": 4}],
        "properties": [
            {"label-value": 3, "area (px)": 12, "class": "T"},
            {"label-value": 9, "class": "B\n", "odd": [1]},
        ],
    }
    multiscale = {
        "axes": [{"name": n, "type": "space", "unit": "micrometer"} for n in "zyx"],
        "datasets": [
            {
                "path": "0",
                "coordinateTransformations": [
                    {"type": "scale", "scale": [2.0, 1.0, 1.0]},
                    {"type": "translation", "translation": [4.0, 0.0, 1.0]},
                ],
            }
        ],
        "version": version,
    }
    ome = {"multiscales": [multiscale], "image-label": about}
    path = tmp_path / "i.zarr" / "labels" / "cells"
    group = zarr.open_group(path, mode="w", zarr_format=2 if version == "0.4" else 3)
    group.attrs.update(ome if version == "0.4" else {"ome": {"version": version, **ome}})
    group.create_array("0", shape=(3, 4, 5), dtype="uint32")[...] = 3
    dataset = read.open(path)
    assert dataset.objects.colors == {3: linear_color((255, 0, 128))}
    assert dataset.objects.columns == {"area (px)": {3: 12.0}, "class": {3: "T", 9: "B"}}
    assert dataset.offset_um == (4.0, 0.0, 1.0)


@pytest.mark.parametrize(
    "odd", [None, [], {"colors": 3}, {"properties": [1, {"label-value": "x"}]}]
)
def test_useless_label_metadata_of_ngff_are_ignored(odd: Any) -> None:
    found = notes_of_ngff(odd)
    assert (found.names, found.colors, found.columns) == ({}, {}, {})


def test_names_in_the_label_table_of_a_nifti_are_read(tmp_path: Path) -> None:
    image = nibabel.Nifti1Image(np.ones((4, 5, 6), np.uint8), np.eye(4))
    image.header.extensions.append(nibabel.nifti1.Nifti1Extension(0, TABLE.replace(b"\x00", b"")))
    nibabel.save(image, tmp_path / "organs.nii.gz")
    dataset = read.open(tmp_path / "organs.nii.gz")
    assert dataset.objects.names == {1: "spleen", 2: "kidney right"}
    assert dataset.objects.colors == {1: linear_color((255, 128, 0))}
    assert "table of labels" in dataset.labels


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"<LabelTable><Label Key='1'>a",
        b'<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]><L><Label Key="1">&e;</Label></L>',
        b"\xff\xfe<Label",
    ],
)
def test_an_invalid_label_table_is_ignored(content: bytes) -> None:
    assert notes_of_nifti([content]).names == {}
