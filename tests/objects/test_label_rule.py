"""Label maps are distinguished from images: synthetic ones, and real ones of both kinds."""

import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial import cKDTree

from corpus import all_cases
from corpus.real import data_folder
from stereocell.objects.label_rule import recognise
from support.exhaustive import sweep

RNG = np.random.default_rng(2)
SHAPE = (24, 96, 96)


def cells(count: int, share: float = 1.0) -> np.ndarray:
    """Return cells of a Voronoi diagram with random numbers, some of which are left out."""
    places = np.stack(np.mgrid[tuple(slice(n) for n in SHAPE)], -1).reshape(-1, 3)
    number = cKDTree(RNG.uniform(0, SHAPE, (count, 3))).query(places)[1].reshape(SHAPE)
    names = RNG.permutation(count * 3)[:count] + 1
    return np.where(RNG.uniform(size=count) < share, names, 0)[number]


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.int16, np.uint32, np.int64])
@pytest.mark.parametrize("share", [1.0, 0.4])
def test_cells_are_labels_with_any_numbers(dtype: type, share: float) -> None:
    voxels = cells(60, share)
    found = recognise(voxels.astype(dtype))
    assert found.kind == "labels"
    assert found.values == len(np.unique(voxels[voxels > 0]))


def test_classes_in_many_pieces_are_labels() -> None:
    field = ndimage.gaussian_filter(RNG.normal(size=SHAPE), 5)
    classes = np.digitize(field, np.quantile(field, [0.3, 0.6, 0.9])).astype(np.uint8)
    assert recognise(classes).kind == "labels"


def test_two_values_are_a_mask_and_one_is_an_image() -> None:
    mask = (cells(40, 0.5) > 0).astype(np.uint8)
    assert recognise(mask).kind == "mask"
    assert recognise(mask * np.uint8(255)).kind == "mask"
    assert recognise(mask * np.uint8(50) + np.uint8(20)).kind == "mask"
    assert recognise(np.zeros(SHAPE, np.uint8)).kind == "image"
    assert recognise(np.full(SHAPE, 7, np.uint8)).kind == "image"


def test_negative_and_real_numbers_are_an_image() -> None:
    voxels = cells(60)
    assert recognise((voxels - 100).astype(np.int16)).kind == "image"
    assert recognise(voxels.astype(np.float32)).kind == "image"


@pytest.mark.parametrize("levels", [64, 255])
def test_a_smooth_image_of_few_levels_is_an_image(levels: int) -> None:
    field = ndimage.gaussian_filter(RNG.normal(size=SHAPE), 6)
    field = levels * (field - field.min()) / np.ptp(field)
    assert recognise(field.astype(np.uint8)).kind == "image"


@pytest.mark.parametrize("ground", [5, 1000, 65535])
def test_an_image_on_an_even_ground_is_an_image(ground: int) -> None:
    """Masked scans are like this, and images in which all dark voxels were cut off at one value."""
    voxels = np.full(SHAPE, ground, np.uint16)
    bodies = cells(400, 0.05) > 0
    voxels[bodies] = RNG.normal(4000, 300, np.count_nonzero(bodies)).astype(np.uint16)
    assert np.count_nonzero(bodies) > 1000
    assert recognise(voxels).kind == "image"


CASES = {
    case.name: case
    for case in all_cases()
    if not case.name.startswith(("balls", "tubes", "membranes"))
}
# One case of each kind: real ones from different instruments, synthetic ones with different grey
# values and shapes, empty ones with different cameras, lights and faults
KEPT = (
    "two classes", "steep background", "saturated", "eight bit", "tissue", "bodies in depth",
    "straight edge", "nested, 40 photons, x 1.5", "empty, counted photons, 0.05",
    "empty, clipped at 10", "empty, scmos, hot pixels", "empty, scmos, zero padding",
    "empty, emccd, plain", "empty, detector, black border", "empty, scmos, ramp x 2",
    "empty, scmos, depth x 28", "empty, scmos, stripes", "inside tissue, scmos, 2",
)  # fmt: skip
REAL = ("nuclei", "ovule walls", "CT skin", "MRI head", "light sheet, cells")


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", sweep(CASES, kept=[*KEPT, *(name for name in REAL if name in CASES)])
)
def test_every_image_of_the_corpus_is_an_image(name: str) -> None:
    voxels, _ = CASES[name].load()
    for half in (64, 32, 16):  # images with many channels are examined in smaller blocks
        middle = tuple(slice(max(0, n // 2 - half), n // 2 + half) for n in voxels.shape)
        assert recognise(voxels[middle]).kind == "image"


@pytest.mark.skipif(data_folder() is None, reason="STEREOCELL_DATA is not set")
def test_real_label_maps_are_labels() -> None:
    import h5py
    import tifffile

    folder = data_folder()
    assert folder is not None
    nuclei = tifffile.imread(folder / "nuclei_stardist/mask3d.tif")
    assert recognise(nuclei).kind == "labels"
    assert recognise((nuclei > 0).astype(np.uint8)).kind == "mask"
    with h5py.File(folder / "ovule_plantseg/sample_ovule.h5") as file:
        assert recognise(file["label"][:]).kind == "labels"
        assert recognise(file["raw"][:]).kind == "image"
