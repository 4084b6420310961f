"""The place of label maps on a patient's image, by the scanners' geometry, in any axis order."""

from pathlib import Path

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray

from stereocell import read
from stereocell.model.errors import SourceError, UsageError
from stereocell.planning.label_maps import find_labels
from stereocell.planning.settings import Settings
from stereocell.read import Dataset
from support import dicom_series, nifti_files
from support.dicom_segmentations import write_segmentation
from support.dicom_series import BODIES, grid, oriented, places, turn, write_series

SHAPE = (24, 30, 28)


def numbered(affine: NDArray[np.float64], shape: tuple[int, int, int]) -> NDArray[np.uint8]:
    """Return labels 1 to 3 for the scene's objects, and 0 elsewhere."""
    labels = np.zeros(shape, np.uint8)
    at = places(affine, shape)
    for number, (centre, sigma, _) in enumerate(BODIES, start=1):
        labels[((at - np.array(centre)) ** 2).sum(axis=-1) < (1.5 * sigma) ** 2] = number
    return labels


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Dataset]:
    folder = tmp_path_factory.mktemp("ct")
    affine = grid("axial", SHAPE, (2.0, 1.8, 1.8))
    write_series(folder, affine, SHAPE)
    return folder, read.open(folder)


def labels_on(scan: tuple[Path, Dataset], path: Path) -> list[tuple[int, NDArray[np.float64]]]:
    """Return each object's label, and its centroid in the image, (z, y, x) in um."""
    (labels,) = find_labels(
        scan[1],
        str(scan[0]),
        {"organs": str(path)},
        settings=Settings(),
        colors=[(1, 1, 1)],
        taken=["CT"],
    ).labels
    source = labels.open()
    voxels = source.read(source.dataset.levels[0].box)
    return [
        (number, np.array(labels.position_um(np.argwhere(voxels == number).mean(axis=0).tolist())))
        for number in np.unique(voxels[voxels > 0]).tolist()
    ]


@pytest.mark.parametrize(
    ("order", "signs"),
    [((0, 1, 2), (1, 1, 1)), ((2, 1, 0), (-1, 1, -1)), ((1, 2, 0), (1, -1, 1))],
)
def test_labels_of_nifti_lie_on_a_dicom_scan(
    scan: tuple[Path, Dataset],
    tmp_path: Path,
    order: tuple[int, int, int],
    signs: tuple[int, int, int],
) -> None:
    shape = (40, 44, 42)
    affine = oriented(order, signs, shape)
    path = nifti_files.write(tmp_path / "organs.nii.gz", affine, numbered(affine, shape))
    image = scan[1]
    brightness = image.read(0, image.levels[0].box).voxels
    found = labels_on(scan, path)
    assert [number for number, _ in found] == [1, 2, 3]
    for _, place in found:
        z, y, x = np.rint(place / np.array(image.levels[0].spacing_um)).astype(int)
        around = brightness[z - 3 : z + 4, y - 3 : y + 4, x - 3 : x + 4]
        peak = np.array(np.unravel_index(around.argmax(), around.shape)) - 3
        assert np.abs(peak).max() <= 1  # index from the middle of the object's box


def refusal(scan: tuple[Path, Dataset], path: Path) -> str:
    with pytest.raises(SourceError) as error:
        labels_on(scan, path)
    return str(error.value)


def test_rotated_skewed_and_distant_labels_are_refused(
    scan: tuple[Path, Dataset], tmp_path: Path
) -> None:
    affine = grid("axial", SHAPE, (2.0, 1.8, 1.8))
    turned = np.eye(4)
    turned[:3, :3] = dicom_series.turn((1, 2, 3), 20)
    path = nifti_files.write(
        tmp_path / "t.nii.gz", turned @ affine, numbered(turned @ affine, SHAPE)
    )
    assert "is rotated to the image" in refusal(scan, path)
    skewed = affine.copy()
    skewed[:3, 0] += 0.3 * skewed[:3, 1]
    path = nifti_files.write(tmp_path / "s.nii.gz", skewed, numbered(skewed, SHAPE))
    assert "resampled onto an orthogonal grid: found averaged numbers of objects" in refusal(
        scan, path
    )
    with pytest.raises(SourceError, match="which mean nothing"):  # even without an image
        find_labels(
            read.open(path),
            str(path),
            {"organs": "."},
            settings=Settings(),
            colors=[(1, 1, 1)],
            taken=[],
        )
    far = affine.copy()
    far[:3, 3] += 500
    path = nifti_files.write(tmp_path / "f.nii.gz", far, numbered(affine, SHAPE))
    assert "lies beside the image" in refusal(scan, path)


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (
            ("i.ome.tif", "l.nii"),
            "axes by a patient's sides, expected its file's own axes as in the image",
        ),
        (
            ("i.nii", "l.tif"),
            "its file's own axes, expected axes by a patient's sides as in the image",
        ),
        (
            ("i.ome.tif", "guess.nii"),
            "axes by guessed sides, expected its file's own axes as in the image",
        ),
        (
            ("i.nii", "guess.nii"),
            "axes by guessed sides, expected axes by a patient's sides as in the image",
        ),
        (("guess.nii", "guess.nii"), ""),
    ],
)
def test_the_orientation_of_labels_is_never_guessed(
    tmp_path: Path, names: tuple[str, str], message: str
) -> None:
    """Readers turn a volume to the patient's sides only if the file states them."""
    voxels = numbered(
        grid("axial", (20, 20, 20)), (20, 20, 20)
    )  # a cube, whose shape does not show its orientation
    spacing = {f"PhysicalSize{axis}": 1.0 for axis in "XYZ"}
    tifffile.imwrite(tmp_path / "i.ome.tif", voxels, metadata={"axes": "ZYX", **spacing})
    tifffile.imwrite(tmp_path / "l.tif", voxels, photometric="minisblack")
    for name in ("i.nii", "l.nii"):
        nifti_files.write(tmp_path / name, np.diag([1.0, 1, 1, 1]), voxels)
    nifti_files.write(tmp_path / "guess.nii", np.diag([1.0, 1, 1, 1]), voxels, "neither")
    image, labels = (tmp_path / name for name in names)
    pair = (image, read.open(image))
    if message:
        assert message in refusal(pair, labels)
    else:
        assert len(labels_on(pair, labels)) == 3


@pytest.mark.parametrize("name", ["CT", "ct"])  # the same file name on Windows
def test_names_of_channels_are_refused_for_label_maps(
    scan: tuple[Path, Dataset], tmp_path: Path, name: str
) -> None:
    affine = grid("axial", SHAPE, (2.0, 1.8, 1.8))
    path = nifti_files.write(tmp_path / "o.nii.gz", affine, numbered(affine, SHAPE))
    with pytest.raises(UsageError, match="a channel has this name already"):
        find_labels(
            scan[1],
            str(scan[0]),
            {name: str(path)},
            settings=Settings(),
            colors=[(1, 1, 1)],
            taken=["CT"],
        )


@pytest.mark.slow
def test_a_segmentation_of_oblique_planes_is_refused_on_an_axial_scan(
    scan: tuple[Path, Dataset], tmp_path: Path
) -> None:
    voxels = np.zeros((6, 20, 20, 1), np.uint8)
    voxels[1:5, 4:16, 4:16] = 1
    oblique = grid(shape=(6, 20, 20), spacing=(2.5, 2.0, 2.2), rotation=turn((1, 2, -0.5), 23.0))
    path = write_segmentation(tmp_path, "BINARY", voxels, affine=oblique)
    with pytest.raises(
        SourceError, match="is rotated to the image, expected labels along the image's"
    ):
        labels_on(scan, path)


def test_colour_images_of_labels_and_names_with_control_characters_are_refused(
    scan: tuple[Path, Dataset], tmp_path: Path
) -> None:
    path = tmp_path / "outlines.tif"
    tifffile.imwrite(path, np.zeros((*scan[1].levels[0].shape, 3), np.uint8), photometric="rgb")
    with pytest.raises(SourceError, match="found colour pixels, expected labels"):
        labels_on(scan, path)
    with pytest.raises(UsageError, match="without control characters"):
        find_labels(
            scan[1],
            str(scan[0]),
            {"\x1b[31m": str(path)},
            settings=Settings(),
            colors=[(1, 1, 1)],
            taken=["CT"],
        )
