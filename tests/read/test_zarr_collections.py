"""OME-Zarr groups of several images: plates, wells, containers of series, labels."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zarr

from conftest import Server
from stereocell import read
from stereocell.cli.__main__ import main
from support.phantoms import f_phantom, write_ome_zarr
from support.reading import refusing

VERSIONS = ("0.4", "0.5")


def group(path: Path, version: str, ome: dict[str, Any]) -> Path:
    attributes = ome if version == "0.4" else {"ome": {"version": version, **ome}}
    zarr.open_group(path, mode="a", zarr_format=2 if version == "0.4" else 3, attributes=attributes)
    return path


def plate(path: Path, version: str, wells: list[str], fields: int = 2) -> Path:
    group(path, version, {"plate": {"wells": [{"path": well} for well in wells]}})
    images = [{"path": str(field)} for field in range(fields)]
    for well in wells[:2]:
        group(path / well.split("/")[0], version, {})
        group(path / well, version, {"well": {"images": images}})
        for field in range(fields):
            write_ome_zarr(path / well / str(field), [f_phantom() + field], version=version)
    return path


def labelled(path: Path, version: str, dtype: Any = np.int32) -> Path:
    """Write an image with two label images, one of which lists its objects."""
    write_ome_zarr(path, [f_phantom()], version=version)
    group(path / "labels", version, {"labels": ["cells", "two words"]})
    for name, objects in (("cells", 3), ("two words", 0)):
        numbers = np.zeros(f_phantom().shape, dtype)
        numbers[2:6, 4:9, 4:9] = 7
        write_ome_zarr(path / "labels" / name, [numbers], version=version)
        label: dict[str, Any] = {"version": version}
        if objects:
            label["properties"] = [{"label-value": n} for n in range(objects)]
        file = path / "labels" / name / (".zattrs" if version == "0.4" else "zarr.json")
        content = json.loads(file.read_text("utf-8"))
        (content if version == "0.4" else content["attributes"]["ome"])["image-label"] = label
        file.write_text(json.dumps(content))
    return path


refusal = refusing(read.open)


@pytest.mark.parametrize("version", VERSIONS)
def test_a_plate_lists_its_wells_and_a_well_lists_its_images(tmp_path: Path, version: str) -> None:
    wells = [f"{row}/{column:02d}" for row in "ABC" for column in range(1, 5)]
    path = plate(tmp_path / "my plate's.zarr", version, wells)
    message = refusal(path)
    assert (
        "a plate of 12 wells (A/01, A/02, A/03, A/04, B/01, B/02, B/03, B/04 and 4 more)" in message
    )
    assert message.endswith(f": open an image of a well by its path, such as {path}/A/01/0")
    message = refusal(path / "A" / "01")
    assert "found a well of 2 images (0, 1), expected the attribute `multiscales`" in message
    assert message.endswith(f": open one by its path, such as {path}/A/01/0")
    assert "found 2 groups (01, 02)" in refusal(path / "A")
    for field in (0, 1):
        dataset = read.open(path / "A" / "02" / str(field))
        voxels = dataset.read(0, dataset.levels[0].box).voxels
        assert np.array_equal(voxels, f_phantom() + field)
        assert dataset.name == f"my plate's-A-02-{field}"


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("listed", [True, False])
def test_a_container_lists_its_images_and_a_single_one_is_opened(
    tmp_path: Path, version: str, listed: bool
) -> None:
    for count in (1, 3):
        path = group(tmp_path / f"{count}.zarr", version, {"bioformats2raw.layout": 3})
        names = [f"image {n}" if listed else str(n) for n in range(count)]
        if listed:
            group(path / "OME", version, {"series": names})
        for name in names:
            write_ome_zarr(path / name, [f_phantom()], version=version)
        if count > 1:
            message = refusal(path)
            held = f"found 3 images ({', '.join(names)}) in one container (bioformats2raw.layout)"
            assert held in message
            assert message.endswith(f"such as {path}/{names[0]}")
        dataset = read.open(path if count == 1 else path / names[2])
        assert np.array_equal(dataset.read(0, dataset.levels[0].box).voxels, f_phantom())


def test_a_container_leads_nowhere_else(tmp_path: Path) -> None:
    write_ome_zarr(tmp_path / "secret.zarr", [f_phantom()])
    path = group(tmp_path / "c.zarr", "0.5", {"bioformats2raw.layout": 3})
    group(path / "OME", "0.5", {"series": ["../secret.zarr"]})
    assert "leads out of the group" in refusal(path)
    group(path / "OME", "0.5", {"series": ["0"]})
    (path / "0").symlink_to(tmp_path / "secret.zarr")
    assert "leads out of the group" in refusal(path)


def test_a_container_in_itself_is_refused(tmp_path: Path) -> None:
    path = group(tmp_path / "c.zarr", "0.5", {"bioformats2raw.layout": 3})
    for series in (".", "0"):
        group(path / "OME", "0.5", {"series": [series]})
        group(path / "0", "0.5", {"bioformats2raw.layout": 3})
        assert "expected the attribute `multiscales`" in refusal(path)
    group(path / "0" / "OME", "0.5", {"series": ["."]})
    assert "found 1 image (.) in one container" in refusal(path)


def test_a_container_of_one_image_is_opened_at_an_address(
    tmp_path: Path, serve: Callable[[Path], Server]
) -> None:
    path = group(tmp_path / "c.zarr", "0.5", {"bioformats2raw.layout": 3})
    group(path / "OME", "0.5", {"series": ["0"]})
    write_ome_zarr(path / "0", [f_phantom()])
    dataset = read.open(f"{serve(tmp_path).url}/c.zarr")
    assert np.array_equal(dataset.read(0, dataset.levels[0].box).voxels, f_phantom())


@pytest.mark.parametrize("version", VERSIONS)
def test_label_images_of_an_image_are_noted(tmp_path: Path, version: str) -> None:
    path = labelled(tmp_path / "i.zarr", version)
    assert read.open(path).notes == (
        "its label images: cells (int32, properties of 3 objects), two words (int32) "
        "(--labels NAME builds the objects of one)",
    )
    assert "a list of labels, 2 label images (cells, two words)" in refusal(path / "labels")


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("dtype", [np.uint8, np.int32])
def test_a_label_image_stops_the_plan_unless_the_user_names_it_as_labels(
    tmp_path: Path, version: str, dtype: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    """The label image holds only one object, so the voxels alone would look like a mask."""
    path = labelled(tmp_path / "i.zarr", version, dtype) / "labels" / "cells"
    out = tmp_path / "out"
    assert main(["plan", str(path), "-o", str(out)]) == 2
    printed = capsys.readouterr().err.strip().splitlines()[-1]
    assert printed.startswith(f"stereocell: {path}: ")
    assert "is a label map: found `image-label` in its attributes" in printed
    assert "--as intensity" in printed
    assert main(["plan", str(path), "-o", str(out), "--as", "intensity"]) == 0


def test_a_place_among_labels_counts_and_a_folder_with_that_name_does_not(
    tmp_path: Path,
) -> None:
    path = write_ome_zarr(tmp_path / "labels" / "i.zarr", [f_phantom()])
    assert read.open(path).labels == ""
    write_ome_zarr(path / "labels" / "cells", [f_phantom()])
    assert "place among the `labels`" in read.open(path / "labels" / "cells").labels
    bare = write_ome_zarr(tmp_path / "image", [f_phantom()])
    write_ome_zarr(bare / "labels" / "cells", [f_phantom()])
    assert "place among the `labels`" in read.open(bare / "labels" / "cells").labels


@pytest.mark.parametrize(
    "ome",
    [
        {"plate": 3},
        {"plate": {"wells": 3}},
        {"plate": {"wells": [{"path": None}, 3, {"path": "../../x"}]}},
        {"plate": {"wells": [{"path": "A/1\n\x1b[31m" + "x" * 5000}]}},
        {"well": []},
        {"well": {"images": [{"path": 5}]}},
        {"bioformats2raw.layout": None},
        {"labels": {"a": 1}},
        {"labels": [None, ["x"]]},
    ],
)
def test_metadata_of_another_form_are_refused_in_one_short_line(
    tmp_path: Path, ome: dict[str, Any]
) -> None:
    message = refusal(group(tmp_path / "g.zarr", "0.5", ome))
    assert "expected the attribute `multiscales`" in message
    assert message.isprintable()
    assert len(message) < 600


@pytest.mark.parametrize("labels", [3, [3], [None], ["../../x"], ["x" * 5000], ["cells\n"] * 900])
def test_label_lists_of_another_form_do_not_affect_the_image(tmp_path: Path, labels: Any) -> None:
    path = write_ome_zarr(tmp_path / "i.zarr", [f_phantom()])
    group(path / "labels", "0.5", {"labels": labels})
    notes = " ".join(read.open(path).notes)
    assert notes.isprintable()
    assert len(notes) < 600
