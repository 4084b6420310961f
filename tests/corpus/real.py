"""Volumes from instruments, in the folder that STEREOCELL_DATA names."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import tifffile
from numpy.typing import NDArray
from scipy import ndimage
from skimage.segmentation import find_boundaries

from corpus.case import Case, Mask
from corpus.collected import collected_cases
from stereocell.model.tiling import Box
from stereocell.read.open_dataset import open as open_dataset

SKIN_HU, BONE_HU = -300.0, 300.0
_CT_SPACING = (488.28, 4002.45, 488.28)  # um; the reader turns the series, so slices lie along y


def data_folder() -> Path | None:
    """Return the folder of real volumes; None if STEREOCELL_DATA does not name a folder."""
    named = os.environ.get("STEREOCELL_DATA")
    return Path(named) if named and Path(named).is_dir() else None


def real_cases() -> Iterator[Case]:
    """Yield the real volumes; none if there is no folder of them."""
    folder = data_folder()
    if folder is None:
        return
    yield Case(
        "nuclei", "labelled", (0.5, 0.25, 0.25), lambda: _nuclei(folder), grid=(1, 2),
        source="StarDist",
    )  # fmt: skip
    yield Case(
        "ovule walls", "labelled", (0.235, 0.15, 0.15), lambda: _ovule(folder), source="PlantSeg"
    )
    for name, hu, level in (("CT skin", SKIN_HU, 0), ("CT bone", BONE_HU, 1)):
        yield Case(
            name, "outlined", _CT_SPACING, lambda hu=hu: _ct(folder, hu), kind="CT", level=level,
            source="dcm_qa_ct",
        )  # fmt: skip
    yield Case(
        "MRI head", "outlined", (1400.0, 1333.0, 1333.0), lambda: _mri(folder), kind="MR",
        source="studyforrest",
    )  # fmt: skip
    yield Case(
        "mouse brain", "outlined", (50.0, 50.0, 50.0), lambda: _mouse(folder), source="cellfinder"
    )
    for channel, name in enumerate(("cells", "autofluorescence")):
        yield Case(
            f"light sheet, {name}", "looked at", (5.0, 2.0, 2.0),
            lambda channel=channel: (_sheet(folder, channel), None),
            source="cellfinder",
        )  # fmt: skip
    yield from collected_cases(folder / "level_corpus")


def _nuclei(folder: Path) -> tuple[NDArray[Any], Mask]:
    read = tifffile.imread
    return read(folder / "nuclei_stardist/img3d.tif"), read(
        folder / "nuclei_stardist/mask3d.tif"
    ) > 0


def _ovule(folder: Path) -> tuple[NDArray[Any], Mask]:
    import h5py

    with h5py.File(folder / "ovule_plantseg/sample_ovule.h5") as file:
        image, label = file["raw"][:], file["label"][:]
    # In the image, walls are four voxels wide: two on each side of the boundary between cells.
    walls = find_boundaries(label, connectivity=1, mode="thick")
    return image, np.asarray(ndimage.binary_dilation(walls))


def _series(folder: Path) -> NDArray[Any]:
    dataset = open_dataset(str(folder))
    return dataset.read(0, Box((0, 0, 0), dataset.levels[0].shape)).voxels


def _ct(folder: Path, hu: float) -> tuple[NDArray[Any], Mask]:
    """Return the CT, and its voxels above `hu` Hounsfield units: the value of skin, or of bone."""
    voxels = _series(folder / "ct_head_ge")
    return voxels, ndimage.median_filter(voxels, (1, 3, 3)) > hu


def _mri(folder: Path) -> tuple[NDArray[Any], Mask]:
    voxels = _series(folder / "mri_t1_7t/dicoms")[::2, ::2, ::2]
    return voxels, _above_air(voxels)


def _mouse(folder: Path) -> tuple[NDArray[Any], Mask]:
    voxels = tifffile.imread(next((folder / "mouse_brain").glob("*.tif")))[::2, ::2, ::2]
    return voxels, _above_air(voxels)


def _sheet(folder: Path, channel: int) -> NDArray[Any]:
    """Return one channel of a mouse brain: labelled cells or autofluorescence, without a truth."""
    voxels = tifffile.imread(next((folder / "brain_cells_2ch").glob("*.tif")))
    return np.ascontiguousarray(voxels[:, channel])


def _above_air(voxels: NDArray[Any]) -> Mask:
    """Return the voxels more than ten standard deviations above the air in the volume's corners."""
    smooth = ndimage.gaussian_filter(voxels.astype(np.float32), 0.7)
    corners = np.concatenate([smooth[z, y, x].ravel() for z in _ENDS for y in _ENDS for x in _ENDS])
    return np.asarray(smooth > np.median(corners) + 10 * max(float(corners.std()), 1.0))


_ENDS = (slice(0, 12), slice(-12, None))
