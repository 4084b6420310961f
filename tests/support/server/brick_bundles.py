"""An OUT with a bundle of two tiles whose volume in r0_c0 is a phantom of several levels."""

import hashlib
import json
from pathlib import Path

import numpy as np

from stereocell.engine.run import Engine
from stereocell.filters.min_max_bricks import mip_levels
from stereocell.formats.ktx2 import encode_2d, encode_3d
from stereocell.transfer.opacity import evaluate, make_transfer_functions
from support.bundles import write_bundle, write_tiles
from support.sealed_files import seal


def phantom(shape=(60, 75, 90)) -> np.ndarray:
    """Return noisy balls in an empty volume, uint8 (z, y, x)."""
    rng = np.random.default_rng(5)
    grid = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1)
    volume = np.zeros(shape)
    for center, radius, value in (((30, 30, 30), 20, 150), ((25, 55, 70), 12, 230)):
        inside = np.linalg.norm(grid - center, axis=-1) < radius
        volume[inside] = value
    volume[volume > 0] += rng.normal(0, 12, np.count_nonzero(volume))
    return np.clip(volume, 0, 255).astype(np.uint8)


def write_out(folder: Path, volume: np.ndarray | None = None) -> Path:
    """Write an OUT; the phantom's spacing is 1 um, and its first drawn texel is at the origin."""
    viewer = folder / "viewer"
    viewer.mkdir(parents=True)
    (viewer / "index.html").write_text("<!doctype html>")
    write_bundle(write_tiles(folder / "stage"), folder / "bundle", viewer, engine=Engine(0))
    if volume is not None:
        replace_volume(folder / "bundle", volume)
    return folder


def replace_volume(bundle: Path, voxels: np.ndarray, channel="CD31", tile="r0_c0") -> None:
    """Put another volume in a bundle and in its volumes.json."""
    path = bundle / "channels" / channel / "volumes.json"
    content = json.loads(path.read_text("utf-8"))
    (entry,) = (e for e in content["volumes"] if e["tile"] == tile)
    texture = encode_3d(mip_levels(voxels))
    (bundle / entry["file"]["path"]).write_bytes(texture.data)
    entry["file"] |= {
        "bytes": len(texture.data),
        "sha256": hashlib.sha256(texture.data).hexdigest(),
    }
    entry["size"] = list(voxels.shape[::-1])
    x, y, z = (n - 3 for n in entry["size"])  # spacings between centres inside the apron of 1
    entry["bounds_um"] = {"min": [0, -y, 0], "max": [x, 0, z]}
    entry["levels"] = [
        {
            "size": list(level.size),
            "offset": level.offset,
            "length": level.length,
            "sha256": hashlib.sha256(
                texture.data[level.offset : level.offset + level.length]
            ).hexdigest(),
        }
        for level in texture.levels
    ]
    path.write_text(json.dumps(content))
    manifest = bundle / "manifest.json"  # written as a new file, as when a bundle is replaced
    text = manifest.read_text("utf-8")
    manifest.unlink()
    manifest.write_text(text)


def replace_transfer_functions(
    bundle: Path, opacities: np.ndarray, channel="CD31", names=("default",), chosen="default"
) -> None:
    """Give a channel other 1D transfer functions: opacities (functions, 256) from 0 to 1."""
    manifest = bundle / "manifest.json"
    content = json.loads(manifest.read_text("utf-8"))
    (entry,) = (c for c in content["channels"] if c["id"] == channel)
    table = np.full((*opacities.shape, 4), 255, dtype=np.uint8)
    table[..., 3] = np.rint(opacities * 255)
    data = encode_2d(table).data
    (bundle / entry["lut"]["path"]).write_bytes(data)
    entry["lut"] |= {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
    entry |= {"transfer_functions": list(names), "transfer_function": chosen}
    entry["transfer_functions_2d"]["names"] = []
    manifest.unlink()
    manifest.write_text(json.dumps(seal(content)))


def read_mri(folder: Path) -> np.ndarray:
    """Return a series of single-frame DICOM files as 8 bits, (z, y, x), between its percentiles."""
    import pydicom

    slices = [pydicom.dcmread(path) for path in sorted(folder.iterdir())]
    normal = np.cross(*np.reshape(slices[0].ImageOrientationPatient, (2, 3)).astype(float))
    slices.sort(key=lambda s: float(np.dot(np.array(s.ImagePositionPatient, float), normal)))
    voxels = np.stack([s.pixel_array for s in slices]).astype(np.float32)
    low, high = np.percentile(voxels[::4], (0.1, 99.9))
    return np.rint(np.clip((voxels - low) / (high - low), 0, 1) * 255).astype(np.uint8)


def write_mri(folder: Path, source: Path) -> Path:
    """Write an OUT of a real head, or of a noisy phantom of its size where there is none."""
    if source.is_dir():
        volume = read_mri(source)
    else:
        volume = np.tile(phantom((96, 96, 96)), (4, 4, 3))[:384, :384, :274]
    histogram = np.histogram(volume, 256, (0, 256))[0]
    functions = make_transfer_functions(histogram, None)
    write_out(folder, volume)
    rows = np.array([evaluate(points) for points in functions.values()])
    replace_transfer_functions(folder / "bundle", rows, names=list(functions))
    return folder
