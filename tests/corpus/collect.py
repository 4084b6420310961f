"""Make the folder `level_corpus`: small public volumes with truths that are not StereoCell's.

    python tests/corpus/collect.py CLONES OUT

CLONES is a folder with a clone of each repository in the table below, in folders OWNER/NAME. Its
folder napari-cellseg3d has the unpacked wheel of that package. OUT is `level_corpus` in the folder
that STEREOCELL_DATA names.

A truth is found in one of four ways:
- a label map that belongs to the volume
- a watershed of the slope from two markers
- the voxels far above the noise of the air
- the voxels above the Hounsfield units of skin
"""

import argparse
import hashlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK
import tifffile
from numpy.typing import NDArray
from scipy import ndimage
from skimage.segmentation import watershed

Spacing = tuple[float, float, float]
Made = tuple[str, NDArray[Any], NDArray[np.bool_] | None, Spacing]

TOTAL = "wasserth/TotalSegmentator/tests/reference_files"  # Apache-2.0
VMTK = "vmtk/vmtk-test-data/input"  # as VMTK: BSD-3-Clause
NIIVUE = "niivue/niivue/packages/niivue/demos/images"  # BSD-2-Clause
IMAGES = "neurolabusc/niivue-images"  # CC BY-NC 4.0; CT_AVM of the IBIS project's database
RADIOMICS = "AIM-Harvard/pyradiomics/data"  # BSD-3-Clause
NEUBIAS = "NEUBIAS/training-resources/image_data"  # CC BY 4.0
IMAGEIO = "imageio/imageio-binaries/images"  # no licence is stated
CELLSEG = "napari-cellseg3d/examples"  # MIT

# Path of each file, and the first 16 digits of its SHA-256
FILES = {
    "ct_trunk": (f"{TOTAL}/example_ct_sm.nii.gz", "e50c00b2914e2cac"),
    "ct_trunk_labels": (f"{TOTAL}/example_seg.nii.gz", "8be652475a4aaae8"),
    "ct_chest": (f"{TOTAL}/aorta_report/test_result/models/ct_cropped.nii.gz", "f776ecfa1326e7e2"),
    "mr_trunk": (f"{TOTAL}/example_mr_sm.nii.gz", "209b46efaff595dd"),
    "mra_aorta": (f"{VMTK}/aorta.mha", "435c368b6ce04011"),
    "mra_aorta_distance": (f"{VMTK}/aorta-final-levelset.mha", "bf376aa5b4f72b68"),
    "monkey_brain": (f"{NIIVUE}/inia19-t1-brain.nii.gz", "0fef8a1f9444865d"),
    "monkey_brain_labels": (f"{NIIVUE}/inia19-NeuroMaps.nii.gz", "291c1b1075190f03"),
    "mr_t1": (f"{IMAGES}/chris_t1.nii.gz", "534a240d1d41881b"),
    "mr_pd": (f"{IMAGES}/chris_PD.nii.gz", "d6d7fcbd5c2fee66"),
    "mra_head": (f"{IMAGES}/chris_MRA.nii.gz", "d4bf431c4b4223e3"),
    "cta_head": (f"{IMAGES}/CT_AVM.nii.gz", "f91976458e16f3c3"),
    "iguana": (f"{IMAGES}/Iguana.nii.gz", "33f52cfdaf893c2c"),
    "mr_gd_thick": (f"{RADIOMICS}/brain1_image.nrrd", "fffdb111ee8b428e"),
    "mr_teaching": (f"{NEUBIAS}/xyz_8bit__mri_head.tif", "cb18e79ddf95c1dc"),
    "nuclei_teaching": (f"{NEUBIAS}/xyz_8bit__nuclei_autothresh.tif", "e1ab7665a0e20ffa"),
    "chromosomes": (f"{NEUBIAS}/xyz_8bit__chromosomes.tif", "ca27860f921d4908"),
    "nucleus": (f"{NEUBIAS}/xyz_8bit__nucleus.tif", "f8b6b997ee59f319"),
    "mitotic_plate": (f"{NEUBIAS}/xyz_8bit__mitotic_plate_calibrated.tif", "9b361da5d56abc8f"),
    "dna": (f"{NEUBIAS}/xyzc_16bit__dna_conf_wf.tif", "3fe86325a5bb8124"),
    "golgi": (f"{NEUBIAS}/xyz_calibrated_16bit__golgi_bfa.tif", "33a0ef2319041c82"),
    "nuclear_envelopes": (f"{NEUBIAS}/xyz_nuclear_envelope_drosophila.tif", "6cdd66917a2478b9"),
    "ct_stent": (f"{IMAGEIO}/stent.npz", "60a83d2296b51ee6"),
    "nuclei_cleared_brain": (f"{CELLSEG}/c5image.tif", "9bb5a3da2ade6f66"),
}
BONES = ((25, 50), (69, 78), (91, 116))  # first and last labels of bones in TotalSegmentator's map


class Clones:
    """Reads files from the clones; each file's hash is checked first."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def path(self, name: str) -> Path:
        """Return the path of a file. Raises SystemExit if it is missing or has another hash."""
        place, digits = FILES[name]
        path = self._folder / place
        if not path.is_file():
            raise SystemExit(f"{path}: not found, expected a clone of the repository")
        found = hashlib.sha256(path.read_bytes()).hexdigest()[: len(digits)]
        if found != digits:
            raise SystemExit(f"{path}: its SHA-256 begins with {found}, expected {digits}")
        return path

    def scan(self, name: str) -> tuple[NDArray[Any], Spacing]:
        """Return the voxels (z, y, x) of a medical image, and its voxel spacing (z, y, x) in um."""
        image = SimpleITK.ReadImage(str(self.path(name)))
        x, y, z = (1000.0 * float(side) for side in image.GetSpacing())
        return SimpleITK.GetArrayFromImage(image), (z, y, x)

    def stack(self, name: str) -> NDArray[Any]:
        """Return the voxels of a TIFF in their stored order."""
        return tifffile.imread(self.path(name))


def steepest(
    voxels: NDArray[Any],
    spacing: Spacing,
    dark: float,
    bright: float,
    *,
    sigma: float = 1.0,
    fills: bool = False,
    least: int = 0,
) -> NDArray[np.bool_]:
    """Return the mask (z, y, x) of objects from a watershed of the slope.

    dark    voxels below this value are markers of the background
    bright  voxels above this value are markers of the objects
    sigma   sigma of a Gaussian filter that is applied first, in units of the finest spacing
    fills   whether holes in the z planes are filled
    least   smallest connected component that is kept, in voxels
    """
    sigmas = [sigma * min(spacing) / side for side in spacing]
    smooth = ndimage.gaussian_filter(voxels.astype(np.float32), sigmas)
    slopes = (ndimage.sobel(smooth, axis) / side for axis, side in enumerate(spacing))
    slope = np.sqrt(sum(one**2 for one in slopes))
    markers = np.where(smooth > bright, 2, np.where(smooth < dark, 1, 0)).astype(np.int32)
    found = watershed(slope, markers) == 2
    if fills:
        found = np.stack([ndimage.binary_fill_holes(plane) for plane in found])
    if least:
        pieces, _ = ndimage.label(found)
        counts = np.bincount(pieces.ravel())
        counts[0] = 0
        found = (counts >= least)[pieces]
    return np.asarray(found)


def out_of_air(voxels: NDArray[Any], side: int = 12) -> NDArray[np.bool_]:
    """Return the mask of voxels more than ten standard deviations above the air.

    The air is measured in the four edges of the stack along z, `side` voxels wide.
    """
    smooth = ndimage.gaussian_filter(voxels.astype(np.float32), 0.7)
    ends = (slice(0, side), slice(-side, None))
    air = np.concatenate([smooth[:, y, x].ravel() for y in ends for x in ends])
    return np.asarray(smooth > np.median(air) + 10 * max(float(air.std()), 1.0))


def skin(hounsfield: NDArray[Any]) -> NDArray[np.bool_]:
    """Return the mask of the patient's body in a CT: values above -300 HU."""
    return np.asarray(ndimage.median_filter(hounsfield, 3) > -300)


def _medical(clones: Clones) -> Iterator[Made]:
    voxels, spacing = clones.scan("ct_trunk")
    labels, _ = clones.scan("ct_trunk_labels")
    bone = np.logical_or.reduce([(labels >= a) & (labels <= b) for a, b in BONES])
    yield "ct_trunk", voxels, skin(voxels), spacing
    yield "ct_trunk_bone", voxels, bone, spacing
    voxels, spacing = clones.scan("ct_chest")
    yield "ct_chest", voxels, skin(voxels), spacing
    voxels, spacing = clones.scan("mra_aorta")
    inside = clones.scan("mra_aorta_distance")[0] < 0
    places = np.argwhere(inside)
    low = np.maximum(places.min(0) - np.array((4, 0, 12)), 0)
    high = places.max(0) + np.array((5, 1, 13))
    crop = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
    yield "mra_aorta", voxels[crop].astype(np.int16), inside[crop], spacing
    voxels, spacing = clones.scan("monkey_brain")
    yield "monkey_brain", voxels, clones.scan("monkey_brain_labels")[0] > 0, spacing
    for name in ("mr_t1", "mr_pd", "mr_gd_thick", "mr_trunk"):
        voxels, spacing = clones.scan(name)
        yield name, voxels, out_of_air(voxels), spacing
    voxels = clones.stack("mr_teaching")
    yield "mr_teaching", voxels, out_of_air(voxels), (5000.0, 1000.0, 1000.0)
    voxels, spacing = clones.scan("cta_head")
    yield "cta_head", voxels.round().astype(np.int16), None, spacing
    voxels, spacing = clones.scan("mra_head")
    yield "mra_head", voxels, None, spacing


def _other(clones: Clones) -> Iterator[Made]:
    voxels, spacing = clones.scan("iguana")
    yield "iguana_body", voxels, steepest(voxels, spacing, 15, 60), spacing
    yield "iguana_bone", voxels, steepest(voxels, spacing, 95, 135), spacing
    with np.load(clones.path("ct_stent")) as file:
        voxels = file["arr_0"]
    spacing = (1000.0, 1000.0, 1000.0)
    yield "ct_stent", voxels, steepest(voxels, spacing, 60, 190, least=200), spacing
    voxels = clones.stack("nuclei_cleared_brain").astype(np.uint16)
    truth = steepest(voxels, (1.5, 1.5, 1.5), 480, 760, least=8)
    yield "nuclei_cleared_brain", voxels, truth, (5.0, 5.0, 5.0)
    dna = clones.stack("dna")
    low, high = np.percentile(dna[:, 0], (85, 99))
    spacing = (0.5, 0.2, 0.2)
    truth = steepest(dna[:, 0], spacing, low, high, sigma=1.5, fills=True, least=500)
    yield "dna_confocal", dna[:, 0], truth, spacing
    yield "dna_widefield", dna[:, 1], None, spacing
    yield "nuclear_envelopes", clones.stack("nuclear_envelopes"), None, spacing


# Name, voxel spacing in um, and the other arguments of `steepest`
_OUTLINED: tuple[tuple[str, Spacing, float, float, dict[str, Any]], ...] = (
    ("nuclei_teaching", (1.0, 0.5, 0.5), 12, 70, {"least": 60}),
    ("chromosomes", (0.5, 0.2, 0.2), 124, 140, {"sigma": 2.5, "least": 300}),
    ("nucleus", (0.4, 0.1, 0.1), 5, 18, {"sigma": 3.0, "fills": True, "least": 3000}),
    ("mitotic_plate", (0.5, 0.08, 0.08), 12, 60, {"sigma": 1.5, "least": 200}),
    ("golgi", (0.5, 0.2, 0.2), 150, 900, {"least": 30}),
)


def _outlined(clones: Clones) -> Iterator[Made]:
    for name, spacing, dark, bright, options in _OUTLINED:
        voxels = clones.stack(name)
        if name == "chromosomes":  # stored with more bits than its values need
            voxels = voxels.astype(np.uint8)
        yield name, voxels, steepest(voxels, spacing, dark, bright, **options), spacing


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("clones", type=Path, help="folder of the clones")
    parser.add_argument("out", type=Path, help="folder of the volumes, made if it is missing")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    clones = Clones(options.clones)
    kinds: tuple[Callable[[Clones], Iterator[Made]], ...] = (_medical, _outlined, _other)
    for kind in kinds:
        for name, voxels, truth, spacing in kind(clones):
            held = np.zeros(0, bool) if truth is None else truth
            np.savez_compressed(
                options.out / f"{name}.npz", voxels=voxels, truth=held, spacing_um=spacing
            )
            print(name, voxels.shape, voxels.dtype, spacing)


if __name__ == "__main__":
    main()
