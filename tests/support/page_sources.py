"""Sources for the page that reads sources without a server, and the pipeline's view of them.

    python -m support.page_sources FOLDER [views]

writes into FOLDER what zarr-python, zipfile and nibabel write. With `views` it prints as JSON, by
the name of the source, the first view that `stereocell view` shows of it.
"""

import base64
import json
import sys
import tempfile
import zipfile
from dataclasses import asdict
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
import zarr
from numcodecs import Blosc
from numpy.typing import NDArray
from skimage.filters import threshold_li
from zarr.codecs import GzipCodec, ZstdCodec

from stereocell.formats.ktx2 import decode_finest
from stereocell.live.first_view import read_channels, write_first_view
from stereocell.model.channel import SurfaceLevel
from stereocell.planning.input_files import as_asked
from stereocell.planning.preset_choice import load_for
from stereocell.planning.settle import settle
from stereocell.steps.open_source import open_source
from stereocell.transfer.channel_statistics import find_statistics, make_appearance

SPACING = (2.0, 0.5, 0.5)
SHAPE = (12, 40, 56)
COLORS = ("FF4000", "20C040")


def two_boxes() -> NDArray[np.uint16]:
    """Return (c, z, y, x): a box at the lower left in channel 0, one at the upper right in 1."""
    rng = np.random.default_rng(5)
    voxels = rng.normal(200, 12, (2, *SHAPE))
    voxels[0, 3:9, 22:36, 6:22] += 1500
    voxels[1, 3:9, 4:18, 34:50] += 900
    return np.clip(np.rint(voxels), 0, 65535).astype(np.uint16)


def halved(voxels: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Return (c, z, y, x) with the means of 2 x 2 voxels along y and x."""
    c, z, y, x = voxels.shape
    return voxels.reshape(c, z, y // 2, 2, x // 2, 2).mean((3, 5)).astype(np.uint16)


def metadata(version: str, levels: int) -> dict[str, Any]:
    axes = [{"name": "t", "type": "time"}, {"name": "c", "type": "channel"}]
    axes += [{"name": n, "type": "space", "unit": "micrometer"} for n in "zyx"]
    z, y, x = SPACING
    datasets = [
        {
            "path": str(level),
            "coordinateTransformations": [
                {"type": "scale", "scale": [1.0, 1.0, z, y * 2**level, x * 2**level]},
                {
                    "type": "translation",
                    "translation": [0.0, 0.0, 0.0, y * (2**level - 1) / 2, x * (2**level - 1) / 2],
                },
            ],
        }
        for level in range(levels)
    ]
    named = {"version": version} if version == "0.4" else {}
    return {
        "multiscales": [{**named, "axes": axes, "datasets": datasets}],
        "omero": {
            "channels": [
                {"label": name, "color": color, "active": True}
                for name, color in zip(("Left", "Right"), COLORS, strict=True)
            ]
        },
    }


def write_image(path: Path, version: str, *, compressor: Any, shards: bool = False) -> None:
    """Write an image (t, c, z, y, x) of two times and two levels; only the first has the boxes."""
    first = two_boxes()
    levels = [first, halved(first)]
    group = zarr.open_group(path, mode="w", zarr_format=2 if version == "0.4" else 3)
    found = metadata(version, len(levels))
    group.attrs.update(found if version == "0.4" else {"ome": {"version": version, **found}})
    for name, level in enumerate(levels):
        voxels = np.stack([level, np.full_like(level, 7)])
        chunks = (1, 1, 4, level.shape[2] // 2, level.shape[3] // 2)
        kinds: dict[str, Any] = {"chunks": chunks, "compressors": compressor}
        if version == "0.4":
            kinds["chunk_key_encoding"] = {"name": "v2", "separator": "/"}
        if shards:
            kinds["shards"] = (1, 1, 12, level.shape[2], level.shape[3])
        array = group.create_array(str(name), shape=voxels.shape, dtype=voxels.dtype, **kinds)
        array[...] = voxels


def write_sided(path: Path) -> None:
    """Write a volume of two levels whose axes have anatomical orientations, as RFC-4 states them.

    No axis runs in the canonical direction.
    """
    rng = np.random.default_rng(9)
    fine = rng.normal(60, 9, (24, 40, 56))
    fine[4:14, 8:30, 10:46] += 500
    fine[6:10, 10:16, 12:20] += 300
    first = np.clip(np.rint(fine), 0, None).astype(np.uint16)
    sides = ("superior-to-inferior", "posterior-to-anterior", "right-to-left")
    axes = [
        {
            "name": name,
            "type": "space",
            "unit": "millimeter",
            "orientation": {"type": "anatomical", "value": side},
        }
        for name, side in zip("zyx", sides, strict=True)
    ]
    shift = [12.0, -30.0, 44.0]
    datasets = [
        {
            "path": str(level),
            "coordinateTransformations": [
                {"type": "scale", "scale": [2.0, 1.5 * 2**level, 1.5 * 2**level]},
                {
                    "type": "translation",
                    "translation": [
                        s + level * o for s, o in zip(shift, (0, 0.75, 0.75), strict=True)
                    ],
                },
            ],
        }
        for level in range(2)
    ]
    group = zarr.open_group(path, mode="w", zarr_format=3)
    ome: dict[str, Any] = {"version": "0.5", "multiscales": [{"axes": axes, "datasets": datasets}]}
    group.attrs["ome"] = ome
    for name, level in enumerate((first, halved(first[np.newaxis])[0])):
        array = group.create_array(
            str(name), shape=level.shape, dtype=level.dtype, chunks=(8, 20, 28)
        )
        array[...] = level


def write_zipped(folder: Path, path: Path) -> None:
    """Write the `.ozx` of RFC-9: stored members, with the root's metadata first."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        archive.comment = json.dumps({"ome": {"version": "0.5"}}).encode()
        for file in sorted(folder.rglob("*"), key=lambda one: (one.name != "zarr.json", str(one))):
            if file.is_file():
                archive.write(file, file.relative_to(folder))


def write_nifti(path: Path) -> None:
    """Write a head-like ball of scaled 1.5 mm voxels, turned a little, stored left-handed."""
    x, y, z = np.mgrid[:60, :50, :40]
    ball = ((x - 30) / 22) ** 2 + ((y - 25) / 20) ** 2 + ((z - 20) / 17) ** 2 < 1
    spot = (x - 40) ** 2 + (y - 25) ** 2 + (z - 28) ** 2 < 16
    rng = np.random.default_rng(3)
    voxels = np.abs(rng.normal(0, 8, ball.shape)) + 300 * ball + 500 * spot
    angle = np.radians(7)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    affine = np.eye(4)
    affine[:3, :3] = turn @ np.diag([-1.5, 1.5, 1.8])
    affine[:3, 3] = (44.0, -30.0, -20.0)
    library: Any = nibabel
    image = library.Nifti1Image(np.rint(voxels).astype(np.int16), affine)
    image.header.set_xyzt_units("mm")
    image.header.set_slope_inter(0.5, 10)
    library.save(image, path)


def first_view(source: Path) -> dict[str, Any]:
    """Return the manifest of the first view, and the voxels and functions of each channel."""
    settings, choice = load_for(source, None, None, flags={})
    plan = settle(str(source), settings, choice)
    dataset = open_source(as_asked(plan.source, plan.settings.plan))
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        write_first_view(plan, read_channels(plan, dataset), root)
        manifest = json.loads((root / "manifest.json").read_text())
        for channel in manifest["channels"]:
            (volume,) = json.loads((root / channel["volumes"]["path"]).read_text())["volumes"]
            voxels = decode_finest((root / volume["file"]["path"]).read_bytes())
            volume["voxels"] = base64.b64encode(voxels.tobytes()).decode()
            channel["volume"] = volume
    for channel, planned in zip(manifest["channels"], plan.channels, strict=True):
        # The rules of a build on all voxels, at the level that the page chooses.
        voxels = dataset.read(planned.index, dataset.levels[0].box, 0).voxels
        statistics = find_statistics(voxels.copy(), plan.settings.window)
        low, high = statistics.window
        shares = (np.clip(voxels, low, high) - low) / (high - low) * 256
        level = float(threshold_li(shares + 0.5)) - 0.5
        shortest = min(n * s for n, s in zip(plan.region.shape, plan.spacing_um, strict=True))
        found = make_appearance(
            planned.name,
            planned.color,
            statistics=statistics,
            level=SurfaceLevel(low + level / 256 * (high - low), None, 0.0),
            confidence=1.0,
            why_unclear="",
            modality=plan.modality,
            depth_voxels=shortest / min(plan.spacing_um),
        )
        channel["window"] = statistics.window
        channel["functions"] = found.transfer_functions
        channel["shapes"] = found.transfer_2d.functions
    return dict(manifest)


def main(folder: Path, *, has_views: bool) -> None:
    write_image(folder / "v04.ome.zarr", "0.4", compressor=Blosc("lz4", shuffle=Blosc.SHUFFLE))
    write_image(folder / "v05.ome.zarr", "0.5", compressor=GzipCodec())
    write_image(folder / "sharded.ome.zarr", "0.5", compressor=ZstdCodec(), shards=True)
    write_zipped(folder / "sharded.ome.zarr", folder / "sharded.ozx")
    write_nifti(folder / "head.nii.gz")
    write_sided(folder / "sided.ome.zarr")
    if has_views:
        found = {path.name: first_view(path) for path in sorted(folder.iterdir())}
        sys.stdout.write(json.dumps(found, default=asdict))


if __name__ == "__main__":
    main(Path(sys.argv[1]), has_views=sys.argv[2:] == ["views"])
