"""Make the scenes of the renderers' bench: volumes, their transfer functions and three cameras.

The volume has the sample generator's nuclei, averaged over 2 x 2 voxels in the plane. This makes
voxels cubes, because NiiVue's opacity depends on the number of voxels along a ray, not on their
size. The outermost two voxels on every side are empty, because renderers end a volume at different
places: at the outermost voxels' centres, at their faces, or an apron before.

Our renderer has no parallel projection, and NiiVue has no other. So ours uses a distant camera with
a field of view of NARROW_DEG. Each is compared with the reference of its own camera.
"""

import hashlib
import json
import os
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stereocell import read
from stereocell.filters.min_max_bricks import min_max_bricks
from stereocell.model.tiling import Box
from stereocell.samples.cycif_geometry import grow_tissue
from stereocell.samples.microscope import SPACING_UM, record
from stereocell.transfer.opacity import make_transfer_functions
from support import reference_raymarch
from support.reference_raymarch import Block, Camera, Values, render

SHAPE = (97, 256, 256)
SPACING = SPACING_UM[0]  # um, edge of the cubes
BORDER = 2
WINDOW = (0.5, 0.998)  # quantiles of the voxels that become 0 and 1
ISO = 0.4  # share of the window, half-way up the nuclei's flanks
HEAD_ISO = 0.2  # share of the window, between air and skin
COLOR = (0.25, 0.55, 1.0)  # linear RGB
SIZE_PX = (512, 512)
FOV_DEG = 30.0
NARROW_DEG = 5.0
DISTANCE_UM = 165.0
TOWARDS_EYE = (0.5, 0.4, 1.0)


@dataclass(frozen=True)
class Scene:
    name: str
    block: Block
    cameras: dict[str, Camera]  # by their names, such as "perspective"

    def write(self, folder: Path) -> None:
        """Write NAME.json and NAME.bin: voxels, then the bricks' smallest and largest values."""
        (voxels,) = self.block.channels
        cameras = {
            name: {
                "eye_um": camera.eye_um,
                "target_um": camera.target_um,
                "fov_deg": camera.fov_deg,
                "half_height_um": camera.half_height_um,
            }
            for name, camera in self.cameras.items()
        }
        about = {
            "size": voxels.shape[::-1],
            "spacing_um": self.block.spacing_um().tolist(),
            "low_um": self.block.low_um,
            "high_um": self.block.high_um,
            "table": np.rint(255 * self.block.tables[0]).astype(int).ravel().tolist(),
            "color": self.block.colors[0].tolist(),
            "cameras": cameras,
            "size_px": SIZE_PX,
        }
        (folder / f"{self.name}.json").write_text(json.dumps(about))
        bricks = min_max_bricks(voxels)
        (folder / f"{self.name}.bin").write_bytes(voxels.tobytes() + bricks.tobytes())


def scene_of(
    name: str, voxels: NDArray[np.uint8], spacing_um: Values, iso: float, function: str
) -> Scene:
    """Return a scene of voxels (z, y, x), whose outermost voxels are the apron."""
    histogram = np.histogram(voxels, 256, (0, 256))[0]
    points = np.array(make_transfer_functions(histogram, iso)[function])
    table = np.ones((1, 256, 4))
    opacity = np.interp(np.arange(256) / 255, points[:, 0], points[:, 1])
    table[0, :, 3] = np.rint(255 * opacity) / 255  # rounded as in the bundle's table
    nx, ny, nz = (n * float(h) for n, h in zip(voxels.shape[::-1], spacing_um, strict=True))
    x, y, z = (float(h) for h in spacing_um)
    low, high = (x, 2 * y - ny, z), (nx - 2 * x, -y, nz - 2 * z)
    block = Block((voxels,), low, high, table, np.array([COLOR]))
    return Scene(name, block, cameras_on((np.array(low) + high) / 2, (nx - 3 * x) / 253 / SPACING))


def cameras_on(target_um: Values, scale: float) -> dict[str, Camera]:
    """Return the cameras by name; all show the target at the same size."""
    x, y, z = (float(v) for v in target_um)
    towards = np.array(TOWARDS_EYE) / np.linalg.norm(TOWARDS_EYE)
    half = scale * DISTANCE_UM * np.tan(np.deg2rad(FOV_DEG) / 2)
    cameras = {}
    for name, fov in (("perspective", FOV_DEG), ("narrow", NARROW_DEG)):
        away = half / np.tan(np.deg2rad(fov) / 2)
        a, b, c = (float(v) for v in target_um + away * towards)
        cameras[name] = Camera((a, b, c), (x, y, z), SIZE_PX, fov_deg=fov)
    near = cameras["perspective"]
    cameras["parallel"] = Camera(near.eye_um, near.target_um, SIZE_PX, half_height_um=float(half))
    return cameras


def nuclei() -> tuple[Scene, Scene]:
    """Return the two scenes of all renderers: a translucent one, and one close to surfaces."""
    depth, height, width = SHAPE
    fine = (depth, 2 * height, 2 * width)
    z, y, x = (n * h for n, h in zip(fine, SPACING_UM, strict=True))
    counts = record(grow_tissue((z, y, x), 0, 1.0), 0, box=Box((0, 0, 0), fine), seed=0)
    cubes = counts.reshape(depth, height, 2, width, 2).mean(axis=(2, 4))
    voxels = windowed(cubes)
    spacing = np.full(3, SPACING)
    return (
        scene_of("nuclei_soft", voxels, spacing, ISO, "soft"),
        scene_of("nuclei_default", voxels, spacing, ISO, "default"),
    )


def brain_cells() -> Scene:
    """Return a real tile of the embedded light-sheet stack, whose voxels aren't cubes."""
    file = resources.files("stereocell.samples") / "brain-cells" / "brain_cells.ome.tif"
    source = read.open(str(file))
    depth, height, width = (min(a, b) for a, b in zip(source.levels[0].shape, SHAPE, strict=True))
    volume = source.read(0, Box((0, 0, 0), (depth, height, width)), 0)
    z, y, x = volume.spacing_um
    voxels = windowed(volume.voxels.astype(np.float64))
    return scene_of("brain_cells", voxels, np.array([x, y, z]), ISO, "default")


def head(*, is_full: bool = False) -> tuple[Scene, ...]:
    """Return the real MRI of STEREOCELL_DATA, as two scenes; none without the data.

    It is averaged over 2 x 2 x 2 voxels unless `is_full`. Its voxels (.667, .667, .7 mm) are
    treated as cubes, which NiiVue needs.
    """
    folder = Path(os.environ.get("STEREOCELL_DATA", "")) / "mri_t1_7t" / "dicoms"
    if not folder.is_dir():
        return ()
    source = read.open(str(folder))
    values = source.read(0, source.levels[0].box, 0).voxels.astype(np.float32)
    spacing = np.full(3, min(source.levels[0].spacing_um))
    name = "mri_full"
    if not is_full:
        even = values[tuple(slice(0, n // 2 * 2) for n in values.shape)]
        z, y, x = (n // 2 for n in even.shape)
        values = even.reshape(z, 2, y, 2, x, 2).mean(axis=(1, 3, 5))
        spacing *= 2
        name = "mri"
    voxels = windowed(values.astype(np.float64))
    return (
        scene_of(f"{name}_soft", voxels, spacing, HEAD_ISO, "soft"),
        scene_of(f"{name}_default", voxels, spacing, HEAD_ISO, "default"),
    )


def windowed(values: Values) -> NDArray[np.uint8]:
    """Return values as 8 bits over WINDOW, with an empty border."""
    low, high = np.quantile(values, WINDOW)
    inner = tuple(slice(BORDER, n - BORDER) for n in values.shape)
    voxels = np.zeros(values.shape, np.uint8)
    voxels[inner] = np.rint(255 * np.clip((values[inner] - low) / (high - low), 0, 1))
    return voxels


def reference(scene: Scene, camera: str, shading: bool, cache: Path) -> Values:
    """Return the picture of a scene by `render`; it is made once and kept in `cache`."""
    block = scene.block
    key = hashlib.sha256(Path(reference_raymarch.__file__).read_bytes())
    for part in (*block.channels, block.tables, block.colors):
        key.update(np.ascontiguousarray(part).tobytes())
    key.update(repr((block.low_um, block.high_um, scene.cameras[camera], shading)).encode())
    file = cache / f"reference_{key.hexdigest()[:16]}.npy"
    if file.exists():
        kept: Values = np.load(file)
        return kept
    picture = render(block, scene.cameras[camera], shading=shading)
    np.save(file, picture)
    return picture
