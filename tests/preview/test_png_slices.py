"""PNG slices of a series, and the JSON file that describes them."""

import json
from itertools import product
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import pydicom
import pytest
from jsonschema import Draft202012Validator
from PIL import Image

from corpus.real import data_folder
from stereocell import read
from stereocell.cli.__main__ import main
from stereocell.planning.plan_source import source_of
from stereocell.planning.settings import PlanOptions, Settings
from stereocell.planning.settle import settle
from stereocell.preview.cut_planes import LONGEST_PX, cut_planes, square_pixels
from stereocell.preview.png_slices import to_bytes, without_surface
from stereocell.steps.open_source import open_source
from stereocell.storage.assets import schema_path
from support import phantoms
from support.dicom_reading import interpolation_bound
from support.dicom_series import (
    BRIGHTEST,
    FEW_ORIENTATIONS,
    ORIENTATIONS,
    grid,
    oriented,
    sample,
    scene,
    tilted,
    turn,
    write_series,
)
from support.exhaustive import sweep
from support.nifti_files import write

SHAPE = (22, 24, 26)


def places_lps_mm(about: dict[str, Any]) -> np.ndarray:
    """Return the LPS coordinates of every pixel, mm, by the JSON, (slices, rows, columns, 3)."""
    count, rows, columns = about["shape"]
    first = np.array([one["first_um"] for one in about["slices"]])
    down, right = np.array(about["step_down_um"]), np.array(about["step_right_um"])
    world = (
        first[:, None, None]
        + np.arange(rows)[None, :, None, None] * down
        + np.arange(columns)[None, None, :, None] * right
    )
    assert len(first) == count
    return np.stack([world[..., 0], -world[..., 2], world[..., 1]], axis=-1) / 1000


def pictures(folder: Path, about: dict[str, Any]) -> np.ndarray:
    images = [Image.open(folder / one["file"]) for one in about["slices"]]
    assert {image.mode for image in images} == {"L"}
    assert [one["file"] for one in about["slices"]] == sorted(
        path.name for path in folder.glob("*.png")
    )
    shown = np.stack([np.asarray(image) for image in images])
    assert list(shown.shape) == about["shape"]
    return shown


def written(source: Path, out: Path, *flags: str) -> tuple[dict[str, Any], np.ndarray]:
    assert main(["slices", str(source), "-o", str(out), *flags]) == 0
    about = json.loads((out / "slices.json").read_text("utf-8"))
    schema = json.loads(schema_path("slices.schema.json").read_text("utf-8"))
    assert list(Draft202012Validator(schema).iter_errors(about)) == []
    return about, pictures(out, about)


@pytest.mark.slow
@pytest.mark.parametrize("plane", ["acquired", "axial", "coronal", "sagittal"])
def test_slices_show_the_scene_where_the_json_says(tmp_path: Path, plane: str) -> None:
    write_series(tmp_path / "s", grid("sagittal", rotation=turn((1, 2, 3), 20)))
    about, shown = written(tmp_path / "s", tmp_path / "out", "--plane", plane)
    assert about["modality"] == "MR"
    assert about["plane"] == ("sagittal" if plane == "acquired" else plane)
    low, high = about["window"]
    expected = 255 * np.clip((scene(places_lps_mm(about)) - low) / (high - low), 0, 1)
    bound = interpolation_bound(2.5) * 255 / (high - low)
    assert np.abs(shown - expected).max() <= 1 + bound


@pytest.mark.slow
def test_uneven_images_of_a_tilted_gantry_are_shown_as_they_are_stored(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shape = (12, 30, 26)
    affine = tilted(grid(shape=shape, spacing=(2.5, 2.0, 2.0)), shape, 15)
    indices = [0, 1, 2, 3, 4.3, 5.6, 7, 8, 9, 10, 11]
    files = write_series(tmp_path / "s", affine, shape, indices=indices)
    about, shown = written(tmp_path / "s", tmp_path / "out")
    assert "11 axial slices, the source's own images, 26 x 30 pixels" in capsys.readouterr().out
    low, high = about["window"]
    stored = np.stack([pydicom.dcmread(path).pixel_array for path in files])[::-1]  # from above
    expected = 255 * np.clip((stored - low) / (high - low), 0, 1)
    assert np.abs(shown - expected).max() <= 0.5 + 1e-3
    headers = [pydicom.dcmread(path).ImagePositionPatient for path in files][::-1]
    assert places_lps_mm(about)[:, 0, 0] == pytest.approx(np.array(headers, float), abs=1e-4)
    across, _ = written(tmp_path / "s", tmp_path / "sides", "--plane", "coronal")
    assert across["shape"][0] > 30  # slices of the grid onto which tilted ones are resampled


@pytest.mark.slow
@pytest.mark.parametrize(
    ("flag", "plane"),
    sweep(
        product([(), ("--neurological",)], ["axial", "coronal", "sagittal"]),
        kept=[((), "axial"), ((), "coronal"), ((), "sagittal"), (("--neurological",), "axial")],
    ),
)
def test_images_of_a_tilted_gantry_lie_where_the_json_says(
    tmp_path: Path, plane: str, flag: tuple[str, ...]
) -> None:
    shape = (12, 30, 26)
    for number, sign in enumerate((1, -1)):
        affine = tilted(grid(plane, shape, rotation=turn((1, 2, 3), 10)), shape, sign * 15)
        write_series(
            tmp_path / f"s{number}", affine, shape, indices=[0, 1, 2, 3.4, 5, 6, 8, 9.3, 11]
        )
        about, shown = written(tmp_path / f"s{number}", tmp_path / f"out{number}", *flag)
        assert (about["plane"], about["shape"][0]) == (plane, 9)
        low, high = about["window"]
        expected = 255 * np.clip((scene(places_lps_mm(about)) - low) / (high - low), 0, 1)
        assert np.abs(shown - expected).max() <= 1 + interpolation_bound(2.2) * 255 / (high - low)


@pytest.mark.exhaustive
@pytest.mark.skipif(data_folder() is None, reason="STEREOCELL_DATA is not set")
def test_a_real_ct_of_28_uneven_tilted_slices_gives_28_pictures(tmp_path: Path) -> None:
    folder = data_folder()
    assert folder is not None
    about, shown = written(folder / "ct_head_ge", tmp_path / "out")
    assert (about["plane"], about["shape"]) == ("axial", [28, 512, 512])
    files = sorted((folder / "ct_head_ge").glob("*.dcm"))
    headers = sorted(
        (pydicom.dcmread(path) for path in files), key=lambda ds: -ds.ImagePositionPatient[2]
    )
    low, high = about["window"]
    for picture, ds in zip(shown, headers, strict=True):
        values = ds.pixel_array.astype(float) * ds.RescaleSlope + ds.RescaleIntercept
        inside = ds.pixel_array != ds.get("PixelPaddingValue")
        expected = 255 * np.clip((values - low) / (high - low), 0, 1)
        assert np.abs(picture - expected)[inside].max() <= 0.5 + 1e-3


@pytest.mark.parametrize(("order", "signs"), sweep(ORIENTATIONS, kept=FEW_ORIENTATIONS))
@pytest.mark.parametrize("kind", ["dicom", "nifti"])
def test_every_plane_of_every_orientation_is_the_right_way_up(
    tmp_path: Path, kind: str, order: tuple[int, ...], signs: tuple[int, ...]
) -> None:
    affine = oriented(order, signs, SHAPE)
    if kind == "dicom":
        write_series(tmp_path / "s", affine, SHAPE)
    else:
        write(tmp_path / "s.nii", affine, np.rint(sample(affine, SHAPE)).astype(np.int16))
    source = str(tmp_path / ("s" if kind == "dicom" else "s.nii"))
    for flag in (False, True):
        plan = settle(source, without_surface(Settings(plan=PlanOptions(neurological=flag))))
        dataset = open_source(source_of(plan))
        for plane in ("acquired", "axial", "coronal", "sagittal"):
            cut = cut_planes(dataset, plan, 0, plane)
            if plane == "acquired":  # the first stored axis is the slices' and the widest
                assert cut.view.name == ("sagittal", "coronal", "axial")[order[0]]
                assert len(cut.first_um) == SHAPE[0]
            shown = np.stack(list(cut.planes))
            assert shown.shape[1:] == cut.shape
            assert cut.pixel_um[0] == pytest.approx(cut.pixel_um[1], rel=0.5 / min(cut.shape))
            k, row, column = np.unravel_index(int(shown.argmax()), shown.shape)
            down, right = cut.steps_um
            world = cut.first_um[k] + row * down + column * right
            found = np.array([world[0], -world[2], world[1]]) / 1000
            assert np.abs(found - BRIGHTEST).max() < 1.5  # voxels are up to 2.5 mm
            left, right_side, top, bottom = cut.view.ends
            middle_row, middle_column = (n / 2 for n in cut.shape)
            assert (column < middle_column) == (left in "LAS")
            assert (column > middle_column) == (right_side in "LAS")
            assert (row < middle_row) == (top in "LAS")
            assert (row > middle_row) == (bottom in "LAS")
            if cut.view.name != "sagittal":
                assert left == ("L" if flag else "R")


@pytest.mark.slow
def test_the_widest_spacing_or_dim_info_says_how_nifti_was_acquired(tmp_path: Path) -> None:
    voxels = np.arange(10 * 11 * 12, dtype=np.int16).reshape(10, 11, 12)
    found = {}
    for name, spacing, info in (
        ("wide", (1, 4, 1), None),
        ("last", (2, 2, 2), None),
        ("stated", (1, 4, 1), 0),
    ):
        nifti = nibabel.Nifti1Image(voxels, np.diag([*spacing, 1]))
        nifti.header.set_xyzt_units("mm")
        if info is not None:
            nifti.header.set_dim_info(slice=info)
        nibabel.save(nifti, tmp_path / f"{name}.nii")
        about, _ = written(tmp_path / f"{name}.nii", tmp_path / name)
        found[name] = about["plane"], about["shape"][0]
    assert found == {"wide": ("coronal", 11), "last": ("axial", 12), "stated": ("sagittal", 10)}


@pytest.mark.slow
def test_microscopy_has_planes_by_its_axes_with_square_pixels(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    voxels = phantoms.f_phantom()
    source = phantoms.write_ome_tiff(
        tmp_path / "f.ome.tif", voxels, names=["F"], spacing=(3.0, 1.0, 1.0)
    )
    depth, height, width = voxels.shape
    about, shown = written(source, tmp_path / "xy")
    assert about["plane"] == "xy"
    assert shown.shape == voxels.shape
    about, shown = written(source, tmp_path / "xz", "--plane", "xz")
    assert about["shape"] == [height, 3 * depth, width]
    assert about["pixel_um"] == [1.0, 1.0]
    assert about["axes_grow_to"] == {"slices": "y", "rows": "z", "columns": "x"}
    low, high = about["window"]
    middle = 255 * np.clip((voxels.transpose(1, 0, 2) - low) / (high - low), 0, 1)
    assert np.abs(shown[:, 1::3] - middle).max() <= 1  # the middle of three is the voxel's own
    capsys.readouterr()
    assert main(["slices", str(source), "-o", str(tmp_path / "no"), "--plane", "axial"]) == 2
    printed = capsys.readouterr().err
    assert "states no position in a patient, expected acquired, xy, xz, yz" in printed
    assert "states no position in a patient, expected acquired, xy, xz, yz" in printed
    assert not (tmp_path / "no").exists()
    two = phantoms.write_ome_tiff(tmp_path / "two.ome.tif", np.stack([voxels, voxels]), "CZYX")
    assert main(["slices", str(two), "-o", str(tmp_path / "no"), "--plane", "axial"]) == 2
    assert (
        "states no position in a patient" in capsys.readouterr().err
    )  # also if several channels are requested
    assert main(["slices", str(two), "-o", str(tmp_path / "no")]) == 2
    assert (
        "found channels Channel0, Channel1, expected one: choose it by --channels"
        in capsys.readouterr().err
    )
    written(two, tmp_path / "one", "--channels", "Channel1")


def test_spacings_far_apart_make_no_huge_picture() -> None:
    shape, pixel = square_pixels((10, 20), (1e9, 1e-6))
    assert max(shape) <= LONGEST_PX
    assert min(shape) >= 1
    assert np.multiply(shape, pixel) == pytest.approx([1e10, 2e-5])


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
    assert (
        "holds something else (letter.txt), expected nothing or slices of"
        in capsys.readouterr().err
    )
    out = str(tmp_path / "out")
    assert main(["slices", str(source), "-o", out]) == 0
    assert main(["slices", str(source), "-o", out, "--region", "2:6,:,:"]) == 0
    names = sorted(file.name for file in Path(out).iterdir())
    assert names == ["0.png", "1.png", "2.png", "3.png", "slices.json"]


@pytest.mark.slow
def test_lengths_of_surfaces_do_not_matter(tmp_path: Path) -> None:
    """Preset mri takes every 1.4 mm for the surface; this head is as large as a grain."""
    write_series(tmp_path / "s", grid(spacing=(0.02, 0.02, 0.02)))
    source, out = str(tmp_path / "s"), tmp_path / "out"
    assert main(["plan", source, "-o", str(tmp_path / "plan"), "--preset", "mri"]) == 2
    assert main(["slices", source, "-o", str(out), "--preset", "mri"]) == 0
    about = json.loads((out / "slices.json").read_text("utf-8"))
    dataset = read.open(source)
    voxels = dataset.read(0, dataset.levels[0].box).voxels
    assert about["window"] == pytest.approx(np.percentile(voxels, (1.0, 99.8)))


def test_more_than_one_channel_is_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    both = np.stack([phantoms.f_phantom()] * 2)
    source = phantoms.write_ome_tiff(tmp_path / "f.ome.tif", both, axes="CZYX", names=["A", "B"])
    assert main(["slices", str(source), "-o", str(tmp_path / "out")]) == 2
    assert "found channels A, B, expected one: choose it by --channels" in capsys.readouterr().err
    assert main(["slices", str(source), "-o", str(tmp_path / "out"), "--channels", "B"]) == 0
