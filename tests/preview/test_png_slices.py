"""PNG slices of a series, with what they show."""

import json
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from PIL import Image

from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.model.volume import zyx_to_xyz
from stereocell.preview.png_slices import to_bytes
from stereocell.storage.assets import schema_path
from support import phantoms
from support.dicom_series import grid, scene, turn, write_series


def test_slices_show_the_scene_where_the_json_says(tmp_path: Path) -> None:
    write_series(tmp_path / "s", grid("sagittal", rotation=turn((1, 2, 3), 20)))
    assert main(["slices", str(tmp_path / "s"), "-o", str(tmp_path / "out")]) == 0
    about = json.loads((tmp_path / "out" / "slices.json").read_text())
    schema = json.loads(schema_path("slices.schema.json").read_text())
    assert list(Draft202012Validator(schema).iter_errors(about)) == []
    assert (about["modality"], about["axes_grow_to"]["slices"]) == ("MR", "anterior")
    assert len(list((tmp_path / "out").iterdir())) == len(about["slices"]) + 1
    images = [Image.open(tmp_path / "out" / name) for name in about["slices"]]
    assert {image.mode for image in images} == {"L"}
    shown = np.stack([np.asarray(image) for image in images])
    assert list(shown.shape) == about["shape"]
    index = np.stack(np.meshgrid(*map(np.arange, shown.shape), indexing="ij"), axis=-1)
    move = np.array(about["placement"])
    world = zyx_to_xyz(index * about["spacing_um"]) @ move[:3, :3].T + move[:3, 3]
    lps = np.stack([world[..., 0], -world[..., 2], world[..., 1]], axis=-1) / 1000
    low, high = about["window"]
    expected = 255 * np.clip((scene(lps) - low) / (high - low), 0, 1)
    assert np.abs(shown - expected).max() <= 1 + 255 / (high - low)


def test_the_window_s_ends_are_black_and_white() -> None:
    plane = np.array([[-5, 0, 50, 100, 900]], np.int16)
    assert to_bytes(plane, (0.0, 100.0)).tolist() == [[0, 0, 128, 255, 255]]


def test_another_folder_is_left_alone_and_slices_are_replaced_as_a_whole(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = phantoms.write_ome_tiff(tmp_path / "f.ome.tif", phantoms.f_phantom(), names=["F"])
    full = tmp_path / "full"
    full.mkdir()
    (full / "letter.txt").write_text("keep")
    assert main(["slices", str(source), "-o", str(full)]) == 1
    assert "exists and holds no slices" in capsys.readouterr().err
    out = str(tmp_path / "out")
    assert main(["slices", str(source), "-o", out]) == 0
    assert main(["slices", str(source), "-o", out, "--region", "2:6,:,:"]) == 0
    names = sorted(file.name for file in Path(out).iterdir())
    assert names == ["0.png", "1.png", "2.png", "3.png", "slices.json"]


def test_lengths_of_surfaces_do_not_matter(tmp_path: Path) -> None:
    """Preset mri takes every 1.4 mm for the surface; this head is as large as a grain."""
    write_series(tmp_path / "s", grid(spacing=(0.02, 0.02, 0.02)))
    source, out = str(tmp_path / "s"), tmp_path / "out"
    assert main(["plan", source, "-o", str(tmp_path / "plan"), "--preset", "mri"]) == 2
    assert main(["slices", source, "-o", str(out), "--preset", "mri"]) == 0
    about = json.loads((out / "slices.json").read_text())
    dataset = read.open(source)
    voxels = dataset.read(0, dataset.levels[0].box).voxels
    assert about["window"] == pytest.approx(np.percentile(voxels, (1.0, 99.8)))


def test_more_than_one_channel_is_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    both = np.stack([phantoms.f_phantom()] * 2)
    source = phantoms.write_ome_tiff(tmp_path / "f.ome.tif", both, axes="CZYX", names=["A", "B"])
    assert main(["slices", str(source), "-o", str(tmp_path / "out")]) == 2
    assert "found A, B, expected --channels with one" in capsys.readouterr().err
    assert main(["slices", str(source), "-o", str(tmp_path / "out"), "--channels", "B"]) == 0
