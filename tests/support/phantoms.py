"""Bodies whose shape is known from theory, and files of them written by the formats' own libraries.

This module does not use stereocell, because the readers are tested against it.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import tifffile
import zarr
from numpy.typing import NDArray
from scipy import ndimage
from scipy.special import erf

F_BACKGROUND, F_BODY = 100, 1000
UNITS = {"z": "micrometer", "y": "micrometer", "x": "micrometer", "t": "second", "c": None}
KINDS = {"z": "space", "y": "space", "x": "space", "t": "time", "c": "channel"}


def f_phantom(scale: int = 1) -> NDArray[np.uint16]:
    """Return a solid letter F, uint16 (z, y, x) = (16, 48, 36) times `scale`.

    Seen with x to the right and rows (y) downwards it reads as an F: stem on the left, long arm on
    top, short arm below it. Only the foot of the stem reaches to high z. Every mirroring or turn
    changes the body.
    """
    body = np.full((16, 48, 36), F_BACKGROUND, np.uint16)
    body[4:8, 6:42, 6:13] = F_BODY  # stem
    body[4:8, 6:13, 13:30] = F_BODY  # long arm, top
    body[4:8, 20:26, 13:23] = F_BODY  # short arm
    body[8:13, 34:42, 6:13] = F_BODY  # foot, towards high z
    return body.repeat(scale, 0).repeat(scale, 1).repeat(scale, 2)


def blurred_ball(
    shape: tuple[int, int, int],
    spacing_um: tuple[float, float, float],
    center_um: tuple[float, float, float],
    radius_um: float,
    sigma_um: float,
) -> NDArray[np.float32]:
    """Return a ball of height 1 convolved with a Gaussian, exact at the voxel centres.

    float32 (z, y, x); with u = (R - r) / (s sqrt 2) and v = (R + r) / (s sqrt 2) it is
    (erf u + erf v) / 2 - s / (r sqrt(2 pi)) (exp(-u^2) - exp(-v^2)), by integrating the Gaussian
    over the ball in shells.
    """
    grids = np.meshgrid(
        *(np.arange(n) * h - c for n, h, c in zip(shape, spacing_um, center_um, strict=True)),
        indexing="ij",
    )
    r = np.maximum(np.sqrt(sum(grid**2 for grid in grids)), 1e-6 * sigma_um)
    u = (radius_um - r) / (sigma_um * np.sqrt(2.0))
    v = (radius_um + r) / (sigma_um * np.sqrt(2.0))
    shells = sigma_um / (r * np.sqrt(2.0 * np.pi)) * (np.exp(-(u**2)) - np.exp(-(v**2)))
    ball: NDArray[np.float32] = (0.5 * (erf(u) + erf(v)) - shells).astype(np.float32)
    return ball


SEAM_TILE = 40  # voxels; the scene is two such tiles each way


def seam_scene(step: float = 1.8, height: float = 1000.0) -> NDArray[np.uint16]:
    """Return bodies on the planes where 2 x 2 x 2 tiles meet, uint16 (z, y, x) = (80, 80, 80).

    Each of the 12 faces between two tiles is crossed by a ball with a cavity (8 x 7 x 7 voxels) or
    by two slabs with a gap (5 voxels) between them, and by a fragment (7 x 3 x 3). All three reach
    past the plane by at most 2 voxels on one side and by 4 or 5 on the other. A ball lies where all
    tiles meet. From tile to tile along each axis, bodies and background become `step` times as
    bright. `height` is the height of the bodies in the darkest tile.
    """
    size, plane = 2 * SEAM_TILE, SEAM_TILE
    grid = np.indices((size,) * 3)
    solid = np.zeros((size,) * 3, bool)
    for axis in range(3):
        for quadrant in range(4):
            low, right = divmod(quadrant, 2)
            n, u, v = (grid[(axis + k) % 3] for k in range(3))
            # each face in its own quadrant, every second one seen from the other side
            n = 2 * plane - n if low else n
            u = size - 1 - u if low else u
            v = size - 1 - v if right else v
            past = (n >= plane - 2) & (n <= plane + 5)
            if low == right:
                ball = (n - plane - 1) ** 2 + (u - 13) ** 2 + (v - 13) ** 2 <= 11**2
                cavity = past & (abs(u - 13) <= 3) & (abs(v - 13) <= 3)
                solid |= ball & ~cavity
            else:
                slabs = (abs(u - 13) <= 9) & (abs(v - 13) <= 9) & (abs(n - plane) <= 12)
                solid |= slabs & ~((n >= plane) & (n <= plane + 4))
            solid |= past & (n >= plane - 1) & (abs(u - 31) <= 1) & (abs(v - 13) <= 1)
    center = sum((along - plane) ** 2 for along in grid) <= 6**2
    counts = height * (0.2 + ndimage.gaussian_filter((solid | center).astype(np.float64), 0.7))
    for along in grid:
        counts *= (step + 1) / 2 + (step - 1) / 2 * np.tanh((along - plane) / 2)
    counts += np.random.default_rng(0).normal(0.0, 10.0, counts.shape)
    return np.rint(counts).astype(np.uint16)


def as_counts(
    field: NDArray[np.float32], low: float, high: float, noise: float = 0.0, seed: int = 0
) -> NDArray[np.uint16]:
    """Scale a field of 0..1 to uint16 between `low` and `high`; add noise of sigma `noise`."""
    counts = low + (high - low) * field
    if noise:
        counts = counts + np.random.default_rng(seed).normal(0.0, noise, field.shape)
    return np.clip(np.rint(counts), 0, 65535).astype(np.uint16)


def write_ome_tiff(
    path: Path,
    voxels: NDArray[Any],
    axes: str = "ZYX",
    spacing: tuple[float, float, float] | None = (0.5, 0.2, 0.2),
    unit: str = "\u00b5m",
    names: Sequence[str] | None = None,
    colors: Sequence[int] | None = None,
    levels: int = 1,
    tile: tuple[int, int] | None = None,
    compression: str | None = "zlib",
) -> Path:
    """Write OME-TIFF; `levels` > 1 adds sub-resolutions by taking every second pixel."""
    metadata: dict[str, Any] = {"axes": axes}
    if spacing is not None:
        for axis, value in zip("ZYX", spacing, strict=True):
            metadata |= {f"PhysicalSize{axis}": value, f"PhysicalSize{axis}Unit": unit}
    if names is not None:
        metadata["Channel"] = {"Name": list(names)}
        if colors is not None:
            metadata["Channel"]["Color"] = list(colors)
    options: dict[str, Any] = {
        "tile": tile,
        "compression": compression,
        "photometric": "minisblack",
    }
    with tifffile.TiffWriter(path, ome=True) as writer:
        writer.write(voxels, subifds=levels - 1, metadata=metadata, **options)
        for level in range(1, levels):
            writer.write(voxels[..., :: 2**level, :: 2**level], subfiletype=1, **options)
    return path


def write_ome_zarr(
    path: Path,
    levels: Sequence[NDArray[Any]],
    axes: str = "zyx",
    version: str = "0.5",
    scales: Sequence[Mapping[str, float]] = ({"z": 0.5, "y": 0.2, "x": 0.2},),
    translations: Sequence[Mapping[str, float] | None] = (None,),
    units: Mapping[str, str | None] = UNITS,
    channels: Sequence[Mapping[str, Any]] | None = None,
    chunks: tuple[int, ...] | None = None,
    compressors: Any = "auto",
    image_transformations: Sequence[Mapping[str, Any]] | None = None,
) -> Path:
    """Write OME-Zarr 0.4 (Zarr v2) or 0.5 (Zarr v3), one array for each level."""
    zarr_format: Any = 2 if version == "0.4" else 3
    group = zarr.open_group(path, mode="w", zarr_format=zarr_format)
    datasets = []
    for index, voxels in enumerate(levels):
        array = group.create_array(
            str(index),
            shape=voxels.shape,
            chunks=chunks or voxels.shape,
            dtype=voxels.dtype,
            compressors=compressors,
            chunk_key_encoding={"name": "v2", "separator": "/"} if zarr_format == 2 else None,
        )
        array[...] = voxels
        scale = [float(scales[index].get(axis, 1.0)) for axis in axes]
        steps: list[dict[str, Any]] = [{"type": "scale", "scale": scale}]
        shift = translations[index] if index < len(translations) else None
        if shift is not None:
            steps.append(
                {"type": "translation", "translation": [float(shift.get(a, 0.0)) for a in axes]}
            )
        datasets.append({"path": str(index), "coordinateTransformations": steps})
    described = [{"name": a, "type": KINDS[a], "unit": units.get(a)} for a in axes]
    multiscale: dict[str, Any] = {
        "axes": [{k: v for k, v in axis.items() if v is not None} for axis in described],
        "datasets": datasets,
    }
    if image_transformations is not None:
        multiscale["coordinateTransformations"] = list(image_transformations)
    ome: dict[str, Any] = {"multiscales": [multiscale]}
    if channels is not None:
        ome["omero"] = {"channels": list(channels)}
    if zarr_format == 2:
        multiscale["version"] = version
        group.attrs.update(ome)
    else:
        group.attrs["ome"] = {"version": version, **ome}
    return path


def write_f_everywhere(folder: Path) -> None:
    """Write the F in every format, for the viewer's orientation tests.

    f.ome.tif, f.ome.zarr, f.nii.gz and dicom/ have the same voxels at the same place.
    """
    from support.dicom_series import write_f_dicom, write_f_nifti

    folder.mkdir(parents=True, exist_ok=True)
    spacing = (0.5, 0.2, 0.2)
    write_ome_tiff(folder / "f.ome.tif", f_phantom(), spacing=spacing, names=["F"])
    scale = dict(zip("zyx", spacing, strict=True))
    write_ome_zarr(folder / "f.ome.zarr", [f_phantom()], scales=[scale], channels=[{"label": "F"}])
    write_f_dicom(folder / "dicom", f_phantom(), spacing)
    write_f_nifti(folder / "f.nii.gz", f_phantom(), spacing)
