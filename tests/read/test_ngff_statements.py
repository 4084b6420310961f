"""Sizes, axes and sides that an OME-Zarr states more than once."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.errors import SourceError, UsageError
from stereocell.read.level_spacing import settle_levels
from stereocell.read.spacing import Grid
from support.phantoms import f_phantom, write_ome_zarr

BODY = f_phantom()
HALF = BODY[::2, ::2, ::2]
UM = {"z": 0.5, "y": 0.2, "x": 0.2}


def test_a_level_whose_scale_contradicts_its_shape_covers_the_same_field(
    tmp_path: Path,
) -> None:
    scales = [UM, {"z": 0.5, "y": 0.4, "x": 0.4}]
    dataset = read.open(write_ome_zarr(tmp_path / "a.zarr", [BODY, HALF], scales=scales))
    assert dataset.levels[1].spacing_um == (1.0, 0.4, 0.4)
    assert dataset.levels[1].origin_um[0] == pytest.approx(0.25)
    assert len(dataset.notes) == 1
    assert "z of level 1" in dataset.notes[0]
    assert "states 1 um, its scale states 0.5 um" in dataset.notes[0]


@pytest.mark.parametrize("rounded", [np.floor, np.ceil])
def test_rounding_of_shapes_is_not_a_contradiction(rounded: Any) -> None:
    shape, grids = (25, 301, 97), []
    for level in range(6):
        factor = 2.0**level
        grids.append(Grid(shape, (0.5 * factor, 0.2 * factor, 0.2 * factor)))
        z, y, x = (max(int(rounded(n / 2)), 1) for n in shape)
        shape = (z, y, x)
    settled, notes = settle_levels(grids)
    assert settled == tuple(grids)
    assert notes == ()


def test_a_stated_spacing_stays_if_the_shape_gives_no_whole_factor() -> None:
    grids = [Grid((30, 100, 100), (1.0, 1.0, 1.0)), Grid((20, 50, 50), (1.0, 2.0, 2.0))]
    settled, notes = settle_levels(grids)
    assert settled[1].spacing_um == (1.0, 2.0, 2.0)
    assert "its scale is used" in notes[0]


def rename(path: Path, names: Any, version: str) -> Path:
    """Write BODY again as the array of level 0, with names for its dimensions."""
    named: Any = {"dimension_names": names} if version == "0.5" else {}
    zarr_format: Any = 3 if version == "0.5" else 2
    array = zarr.create_array(
        path / "0", shape=BODY.shape, dtype="u2", zarr_format=zarr_format, overwrite=True, **named
    )
    if version == "0.4":
        array.attrs["_ARRAY_DIMENSIONS"] = names
    array[...] = BODY
    return path


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_axes_in_another_order_than_the_dimensions_are_refused_and_can_be_chosen(
    tmp_path: Path, version: str
) -> None:
    path = write_ome_zarr(tmp_path / "a.zarr", [BODY], version=version)
    rename(path, list("xyz"), version)
    with pytest.raises(
        SourceError, match=r"z, y, x in `axes`.* x, y, z .*--axes zyx or --axes xyz"
    ):
        read.open(path)
    stored = read.open(path, axes="zyx")
    np.testing.assert_array_equal(stored.read(0, stored.levels[0].box).voxels, BODY)
    turned = read.open(path, axes="xyz")
    assert turned.levels[0].spacing_um == (0.5, 0.2, 0.2)
    np.testing.assert_array_equal(turned.read(0, turned.levels[0].box).voxels, BODY.transpose())


@pytest.mark.parametrize("names", [["z", "y", "x"], ["dim_0", "dim_1", "dim_2"], ["Z", "Y", "X"]])
def test_dimensions_that_agree_or_have_other_names_need_no_choice(
    tmp_path: Path, names: list[str]
) -> None:
    path = rename(write_ome_zarr(tmp_path / "a.zarr", [BODY]), names, "0.5")
    assert read.open(path).notes == ()


def test_other_letters_of_dimensions_are_noted(tmp_path: Path) -> None:
    path = rename(write_ome_zarr(tmp_path / "a.zarr", [BODY]), list("tyx"), "0.5")
    assert "axes: `axes` of the image states z, y, x" in read.open(path).notes[0]


def test_axes_are_compared_with_names_in_words_too(tmp_path: Path) -> None:
    path = rename(write_ome_zarr(tmp_path / "a.zarr", [BODY]), ["column", "row", "plane"], "0.5")
    with pytest.raises(SourceError, match="x, y, z in the names of the array's dimensions"):
        read.open(path)


def test_axes_of_each_level_are_compared_with_the_names_of_its_dimensions(tmp_path: Path) -> None:
    scales = [UM, {axis: 2 * step for axis, step in UM.items()}]
    path = write_ome_zarr(tmp_path / "a.zarr", [BODY, HALF], version="0.5", scales=scales)
    level = zarr.create_array(
        path / "1", shape=HALF.shape, dtype="u2", dimension_names=list("xyz"), overwrite=True
    )
    level[...] = HALF
    with pytest.raises(SourceError, match="x, y, z in the names of the array's dimensions"):
        read.open(path)


@pytest.mark.parametrize("version", ["0.4", "0.5"])
def test_the_one_image_of_a_container_is_planned_with_all_its_chunks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], version: str
) -> None:
    zarr_format: Any = 2 if version == "0.4" else 3
    root = zarr.open_group(tmp_path / "c.zarr", mode="w", zarr_format=zarr_format)
    layout = {"bioformats2raw.layout": 3}
    root.attrs.update(layout if version == "0.4" else {"ome": layout})
    write_ome_zarr(tmp_path / "c.zarr" / "0", [BODY], version=version)
    assert main(["plan", str(tmp_path / "c.zarr"), "-o", str(tmp_path / "out")]) == 0
    assert "not stored" not in capsys.readouterr().err


def container(tmp_path: Path, physical: str, **options: Any) -> Path:
    """Write a container as bioformats2raw does, with the OME-XML of the converted file."""
    root = zarr.open_group(tmp_path / "c.zarr", mode="w", zarr_format=2)
    root.attrs["bioformats2raw.layout"] = 3
    path = write_ome_zarr(tmp_path / "c.zarr" / "0", [BODY], version="0.4", **options)
    (tmp_path / "c.zarr" / "OME").mkdir()
    (tmp_path / "c.zarr" / "OME" / "METADATA.ome.xml").write_text(
        '<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06"><Image ID="Image:0">'
        '<Pixels ID="Pixels:0" DimensionOrder="XYZCT" Type="uint16" SizeX="36" SizeY="48" '
        f'SizeZ="16" SizeC="1" SizeT="1" {physical}><MetadataOnly/></Pixels></Image></OME>'
    )
    return path


def test_the_xml_of_a_converted_file_is_compared_with_the_scale(tmp_path: Path) -> None:
    path = container(tmp_path, 'PhysicalSizeX="0.2" PhysicalSizeY="0.2" PhysicalSizeZ="2.5"')
    for opened in (path, path.parent):
        dataset = read.open(opened)
        assert dataset.levels[0].spacing_um == (0.5, 0.2, 0.2)
        assert len(dataset.notes) == 1
        assert "scale states 0.5 um, OME/METADATA.ome.xml states 2.5 um" in dataset.notes[0]


def test_the_xml_of_a_converted_file_gives_a_spacing_that_the_image_lacks(tmp_path: Path) -> None:
    path = container(
        tmp_path, 'PhysicalSizeX="0.2" PhysicalSizeY="0.2" PhysicalSizeZ="2.5"',
        units=dict.fromkeys("zyx"),
    )  # fmt: skip
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == (2.5, 0.2, 0.2)
    assert "OME/METADATA.ome.xml is used" in dataset.notes[0]


def orient(path: Path, *values: str) -> Path:
    group = zarr.open_group(path)
    ome: Any = dict(group.attrs["ome"])  # type: ignore[arg-type]
    for axis, value in zip(ome["multiscales"][0]["axes"], values, strict=True):
        axis["orientation"] = {"type": "anatomical", "value": value}
    group.attrs["ome"] = ome
    return path


def test_orientations_of_axes_give_the_sides(tmp_path: Path) -> None:
    """Stored z runs from feet to head, rows to the front, columns to the right."""
    moves = [{"z": 1.0, "y": 2.0, "x": 3.0}, {"z": 1.25, "y": 2.1, "x": 3.1}]
    scales = [UM, {axis: 2 * length for axis, length in UM.items()}]
    path = write_ome_zarr(tmp_path / "a.zarr", [BODY, HALF], scales=scales, translations=moves)
    orient(path, "inferior-to-superior", "posterior-to-anterior", "left-to-right")
    dataset = read.open(path)
    assert dataset.has_sides
    # In canonical order, z runs to the front, y to the feet and x to the left.
    expected = BODY.transpose(1, 0, 2)[:, ::-1, ::-1]
    box = dataset.levels[0].box
    np.testing.assert_array_equal(dataset.read(0, box).voxels, expected)
    coarse = dataset.levels[1]
    np.testing.assert_array_equal(
        dataset.read(0, coarse.box, 1).voxels, HALF.transpose(1, 0, 2)[:, ::-1, ::-1]
    )
    assert dataset.levels[0].spacing_um == (0.2, 0.5, 0.2)
    # y and x are reversed, so their first canonical voxels are the last stored ones.
    last_fine = np.array([2.0, -(1 + 15 * 0.5), -(3 + 35 * 0.2)])
    last_coarse = np.array([2.1, -(1.25 + 7 * 1.0), -(3.1 + 17 * 0.4)])
    assert coarse.origin_um == pytest.approx(tuple(last_coarse - last_fine))
    # World: x to the left, y to the head, z to the front, from the stored axes' zero.
    corner = np.array(dataset.placement) @ [0.0, 0.0, 0.0, 1.0]
    assert corner[:3] == pytest.approx([-(3 + 35 * 0.2), 1 + 15 * 0.5, 2.0])
    assert dataset.slice_axis(0) == 1


@pytest.mark.parametrize(
    "values",
    [
        ("inferior-to-superior", "left-to-right", "right-to-left"),
        ("proximal-to-distal", "posterior-to-anterior", "left-to-right"),
    ],
)
def test_orientations_without_three_directions_are_noted(
    tmp_path: Path, values: tuple[str, ...]
) -> None:
    dataset = read.open(orient(write_ome_zarr(tmp_path / "a.zarr", [BODY]), *values))
    assert not dataset.has_sides
    assert "the sides are unknown" in dataset.notes[0]
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, BODY)


def test_a_scale_that_image_and_level_both_state_is_noted(tmp_path: Path) -> None:
    twice = [{"type": "scale", "scale": [0.5, 0.2, 0.2]}]
    path = write_ome_zarr(tmp_path / "a.zarr", [BODY], image_transformations=twice)
    dataset = read.open(path)
    assert dataset.levels[0].spacing_um == pytest.approx((0.25, 0.04, 0.04))
    assert "the same scale" in dataset.notes[0]


def test_the_second_image_of_a_group_is_a_series(tmp_path: Path) -> None:
    scales = [UM, {axis: 2 * um for axis, um in UM.items()}]
    path = write_ome_zarr(tmp_path / "a.zarr", [BODY, HALF], scales=scales)
    group = zarr.open_group(path, mode="r+")
    ome: Any = group.attrs["ome"]
    (first,) = ome["multiscales"]
    second = {**first, "datasets": first["datasets"][1:]}
    group.attrs["ome"] = {**ome, "multiscales": [first, second]}
    assert ["16 x 48 x 36" in line for line in read.list_series(path)] == [True, False]
    dataset = read.open(path, series=2)
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, HALF)
    assert "building --series 2, asked for; not built: --series 1: 16 x" in dataset.notes[-1]
    with pytest.raises(UsageError, match="found 3, expected 1 to 2"):
        read.open(path, series=3)


def test_a_second_image_that_is_not_a_volume_is_listed(tmp_path: Path) -> None:
    path = write_ome_zarr(tmp_path / "a.zarr", [BODY])
    group = zarr.open_group(path, mode="r+")
    ome: Any = group.attrs["ome"]
    group.attrs["ome"] = {**ome, "multiscales": [*ome["multiscales"], {"datasets": []}]}
    assert "can't be read; no volume" in read.list_series(path)[1]
    assert "not built: --series 2" in read.open(path).notes[-1]


@pytest.mark.parametrize(
    ("stored", "image", "group", "expected"),
    [
        (2, "0.5", None, "0.5 is stated, which uses Zarr v3, but the files are Zarr v2"),
        (3, "0.4", "0.5", "`version` of the image states 0.4, `version` of the group states 0.5"),
        (2, "0.4", None, ""),
        (3, None, "0.5", ""),
    ],
)
def test_a_version_that_the_files_contradict_is_noted(
    tmp_path: Path, stored: Any, image: str | None, group: str | None, expected: str
) -> None:
    axes = [{"name": a, "type": "space", "unit": "micrometer"} for a in "zyx"]
    scale = [{"type": "scale", "scale": [0.5, 0.2, 0.2]}]
    entry: dict[str, Any] = {
        "axes": axes,
        "datasets": [{"path": "0", "coordinateTransformations": scale}],
    }
    entry |= {"version": image} if image else {}
    ome: dict[str, Any] = {"multiscales": [entry], **({"version": group} if group else {})}
    root = zarr.open_group(tmp_path / "a.zarr", mode="w", zarr_format=stored)
    root.create_array("0", data=BODY)
    root.attrs.update({"ome": ome} if stored == 3 else ome)
    dataset = read.open(tmp_path / "a.zarr")
    np.testing.assert_array_equal(dataset.read(0, dataset.levels[0].box).voxels, BODY)
    assert bool(dataset.notes) == bool(expected)
    assert all("version of OME-Zarr" in note for note in dataset.notes)
    assert expected in "".join(dataset.notes)
