"""Labels of the axes of NRRD, written by pynrrd."""

from pathlib import Path
from typing import Any

import nrrd
import numpy as np
import pytest

from stereocell import read
from support.dicom_reading import whole
from support.phantoms import f_phantom

SPACING = {"z": 0.5, "y": 0.2, "x": 0.25}  # um


def write(path: Path, order: str, labels: list[str], **fields: Any) -> Path:
    """Write the phantom with axes in an order, fastest first, with pynrrd."""
    voxels = np.ascontiguousarray(f_phantom().transpose(["zyx".index(axis) for axis in order]))
    about = {"spacings": [SPACING[axis] for axis in order], "units": ["um"] * 3, **fields}
    nrrd.write(str(path), voxels, {"encoding": "raw", "labels": labels, **about})
    return path


@pytest.mark.parametrize(
    ("order", "labels"),
    [("zyx", ["z", "y", "x"]), ("xzy", ["X", "Z", "Y"]), ("zyx", ["depth", "height", "width"]),
     ("zxy", ["depth", "column", ""])],
)  # fmt: skip
def test_labels_name_the_order_of_the_axes(tmp_path: Path, order: str, labels: list[str]) -> None:
    dataset = read.open(write(tmp_path / "a.nrrd", order, labels))
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))
    shown = f"order of the axes: {', '.join(order)}, fastest first, by the header's labels"
    assert dataset.notes == (shown,)


@pytest.mark.parametrize("labels", [["x", "y", "z"], ["a", "b", "c"], ["x", "x", "z"]])
def test_labels_of_the_usual_order_or_of_no_axes_need_no_note(
    tmp_path: Path, labels: list[str]
) -> None:
    dataset = read.open(write(tmp_path / "a.nrrd", "xyz", labels))
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert dataset.notes == ()


def test_labels_distinguish_time_and_channels_from_the_axes_of_space(tmp_path: Path) -> None:
    voxels = np.stack([f_phantom(), f_phantom() + 1]).transpose(0, 3, 2, 1)
    about = {"spacings": [1.0, 0.25, 0.2, 0.5], "units": ["", "um", "um", "um"]}
    for label in ("t", "c"):
        path = tmp_path / f"{label}.nrrd"
        nrrd.write(str(path), voxels, {"labels": [label, "x", "y", "z"], **about})
    channels, times = read.open(tmp_path / "c.nrrd"), read.open(tmp_path / "t.nrrd")
    second = channels.read(1, channels.levels[0].box).voxels
    np.testing.assert_array_equal(second, f_phantom() + 1)
    assert (times.time_points, len(times.channels)) == (2, 1)


def test_labels_that_contradict_a_patient_s_directions_are_noted(tmp_path: Path) -> None:
    fields = {"space": "LPS", "space directions": np.diag([0.25, 0.2, 0.5])}
    dataset = read.open(
        write(tmp_path / "a.nrrd", "xyz", ["z", "y", "x"], spacings=[], units=[], **fields)
    )
    (note,) = [note for note in dataset.notes if note.startswith("axes of space")]
    assert "space directions states x, y, z, labels states z, y, x" in note


def test_a_negative_spacing_is_noted_and_its_size_used(tmp_path: Path) -> None:
    steps = [SPACING["x"], -SPACING["y"], SPACING["z"]]
    dataset = read.open(write(tmp_path / "a.nrrd", "xyz", ["x", "y", "z"], spacings=steps))
    np.testing.assert_array_equal(whole(dataset), f_phantom())
    assert dataset.levels[0].spacing_um == pytest.approx(tuple(SPACING.values()))
    (note,) = dataset.notes
    assert note.startswith("spacings: found 0.25 -0.2 0.5, one of which is negative")
