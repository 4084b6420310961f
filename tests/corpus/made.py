"""Volumes made by script: objects with the faults of cameras and stages, and empty fields."""

import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from corpus.case import Case, Mask
from support import iso_value_family

SHAPE = (48, 160, 160)
SPACING = (0.28, 0.14, 0.14)  # um, (z, y, x)
BLUR = (1.25, 1.15, 1.15)  # sigma of the microscope, in voxels
Field = NDArray[np.float64]


@dataclass(frozen=True)
class Camera:
    """A model of a camera, which converts photons to voxel values."""

    gain: float
    offset: float
    read_noise: float  # electrons
    excess: float = 1.0  # factor on the variance of the photon count
    largest: int = 65535

    def shoot(self, photons: Field, rng: np.random.Generator) -> NDArray[np.uint16]:
        """Return voxel values for mean photon counts (z, y, x)."""
        counted = rng.poisson(np.maximum(photons, 0) / self.excess) * self.excess
        electrons = counted + rng.normal(0, self.read_noise, photons.shape)
        return np.clip(np.rint(electrons * self.gain + self.offset), 0, self.largest).astype(
            np.uint16
        )


CAMERAS = {
    "scmos": Camera(gain=2.2, offset=100, read_noise=1.6),
    "emccd": Camera(gain=18.0, offset=400, read_noise=0.3, excess=2.0),
    "detector": Camera(gain=3.0, offset=0, read_noise=0.2, largest=255),
}


def _rng(name: str) -> np.random.Generator:
    return np.random.default_rng(zlib.crc32(name.encode()))


def _axes() -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    z, y, x = np.ogrid[: SHAPE[0], : SHAPE[1], : SHAPE[2]]
    return z * SPACING[0], y * SPACING[1], x * SPACING[2]


def _balls(rng: np.random.Generator, count: int, radius: tuple[float, float]) -> Mask:
    """Return a mask of balls inside the volume; `radius` is the range of radii in um."""
    z, y, x = _axes()
    mask = np.zeros(SHAPE, bool)
    for _ in range(count):
        r = rng.uniform(*radius)
        c = [rng.uniform(r, n * h - r) for n, h in zip(SHAPE, SPACING, strict=True)]
        mask |= (z - c[0]) ** 2 + (y - c[1]) ** 2 + (x - c[2]) ** 2 < r**2
    return mask


def _seen(mask: Mask, height: Field | float, background: Field | float) -> Field:
    """Return mean photon counts: objects of a given height, blurred, plus a background."""
    field = np.where(mask, height, 0.0).astype(np.float64)
    return np.asarray(ndimage.gaussian_filter(field, BLUR) + background, np.float64)


def _texture(rng: np.random.Generator, sigma: float) -> Field:
    """Return a smooth random field with mean 0 and standard deviation 1.

    `sigma` is the sigma of the Gaussian filter within the z planes, in voxels; along z it is half.
    """
    field = ndimage.gaussian_filter(rng.normal(size=SHAPE), (sigma / 2, sigma, sigma))
    return np.asarray((field - field.mean()) / field.std(), np.float64)


def _empty(camera: str, fault: str) -> NDArray[np.uint16]:
    """Return a tile without tissue, with one fault of the camera or the stage."""
    rng = _rng(f"empty {camera} {fault}")
    photons = np.full(SHAPE, 3.0)
    if fault == "vignetting":
        _, y, x = _axes()
        off = ((y - y.mean()) ** 2 + (x - x.mean()) ** 2) / (y.mean() ** 2 + x.mean() ** 2)
        photons = photons * (1 - 0.5 * off)
    voxels = CAMERAS[camera].shoot(photons, rng)
    if fault == "hot pixels":
        hot = rng.uniform(size=SHAPE[1:]) < 2e-4
        voxels[:, hot] = np.minimum(voxels[:, hot] + 40 * CAMERAS[camera].gain, 65535).astype(
            np.uint16
        )
        voxels[rng.uniform(size=SHAPE) < 2e-5] = CAMERAS[camera].largest
    if fault == "zero padding":
        voxels[:, :40] = 0
        voxels[:6] = 0
    if fault == "black border":
        voxels[:, :12] = voxels[:, -12:] = voxels[:, :, :12] = voxels[:, :, -12:] = 0
    if fault == "black corner":
        _, y, x = np.ogrid[: SHAPE[0], : SHAPE[1], : SHAPE[2]]
        voxels[np.broadcast_to(x + y < 90, SHAPE)] = 0
    return voxels


FAULTS = ("plain", "hot pixels", "vignetting", "zero padding", "black border", "black corner")


LIGHTS = ("ramp x 2", "ramp x 3", "depth x 2", "depth x 4")
HARD_LIGHTS = ("depth x 10", "depth x 28", "stripes", "tissue x 4")


def _uneven_light(camera: str, light: str) -> NDArray[np.uint16]:
    """Return a tile with only a background, under uneven light."""
    z, _, x = _axes()
    kind, _, factor = light.split()
    along = x / x.max() if kind == "ramp" else z / z.max()
    times, sees = float(factor), CAMERAS[camera]
    dark = min(40.0, 0.2 * sees.largest / sees.gain)  # photons; low enough not to saturate
    photons = dark * (1 + (times - 1) * along if kind == "ramp" else times ** (1 - along))
    whole = np.broadcast_to(photons, SHAPE).astype(np.float64)
    return sees.shoot(whole, _rng(f"light {camera} {light}"))


def _hard_light(camera: str, light: str) -> NDArray[np.uint16]:
    """Return an empty tile under uneven light that makes a wrong level look clear."""
    z, y, _ = (axis / axis.max() for axis in _axes())
    sees, rng = CAMERAS[camera], _rng(f"hard light {camera} {light}")
    most = min(100.0, 0.25 * sees.largest / sees.gain)  # photons
    photons = {
        "depth x 10": most * 10.0**-z,
        "depth x 28": 2 * most * 28.0**-z,
        "stripes": most * (1 + 0.1 * np.sin(46 * y)),
        "tissue x 4": most * 4.0**-z * np.exp(0.12 * _texture(rng, 6.0)),
    }[light]
    return sees.shoot(np.broadcast_to(photons, SHAPE).astype(np.float64), rng)


def _bodies_in_depth() -> tuple[NDArray[np.uint16], Mask]:
    """Objects on a weak background, in light that falls to a sixth with depth."""
    rng = _rng("bodies in depth")
    mask = _balls(rng, 45, (1.0, 1.8))
    z, _, _ = _axes()
    return CAMERAS["scmos"].shoot(_seen(mask, 200.0, 25.0) * 6.0 ** (-z / z.max()), rng), mask


def _slab() -> tuple[NDArray[np.uint16], Mask]:
    """A section of tissue that fills the field of view, between empty planes."""
    rng = _rng("slab")
    z, y, x = _axes()
    mask = np.abs(z - 6.7 - 0.4 * np.sin(x / 4) - 0.4 * np.cos(y / 5)) < 3.5
    height = 60 * np.exp(0.2 * _texture(rng, 6.0))
    return CAMERAS["scmos"].shoot(_seen(mask, height, 4.0), rng), mask


def _counted(photons: float) -> NDArray[np.uint8]:
    """Return an empty tile of a detector that counts single photons; `photons` is their mean."""
    return _rng(f"counted {photons}").poisson(photons, SHAPE).astype(np.uint8)


def _clipped(offset: float) -> NDArray[np.uint8]:
    """Return an empty tile of a detector whose offset is so low that most voxels are 0."""
    noise = _rng(f"clipped {offset}").normal(offset, 12.0, SHAPE)
    return np.clip(np.rint(noise), 0, 255).astype(np.uint8)


def _straight_edge(degrees: float) -> tuple[NDArray[np.uint16], Mask]:
    """A piece of tissue with a straight edge, at an angle of `degrees` to the y axis."""
    rng = _rng(f"edge {degrees}")
    z, y, x = _axes()
    mask = np.broadcast_to(x < 11 + np.tan(np.radians(degrees)) * (y - 11) + 0 * z, SHAPE).copy()
    height = 60 * np.exp(0.2 * _texture(rng, 6.0))
    return CAMERAS["scmos"].shoot(_seen(mask, height, 6.0), rng), mask


def _inside_tissue(camera: str, sigma: float) -> NDArray[np.uint16]:
    """Return a tile inside tissue: soft texture without any boundary."""
    rng = _rng(f"inside {camera} {sigma}")
    return CAMERAS[camera].shoot(40 * np.exp(0.12 * _texture(rng, sigma)), rng)


def _two_classes() -> tuple[NDArray[np.uint16], Mask]:
    """Two kinds of cells, one ten times as bright."""
    rng = _rng("two classes")
    dim, bright = _balls(rng, 40, (1.0, 1.7)), _balls(rng, 12, (1.0, 1.7))
    height = np.where(bright, 400.0, 40.0)
    return CAMERAS["scmos"].shoot(_seen(dim | bright, height, 6.0), rng), dim | bright


def _blob() -> tuple[NDArray[np.uint16], Mask]:
    """One bright blob in an empty field: .1 % of the voxels."""
    rng = _rng("blob")
    z, y, x = _axes()
    mask = (z - 6.5) ** 2 + (y - 8.0) ** 2 + (x - 14.0) ** 2 < 1.6**2
    return CAMERAS["scmos"].shoot(_seen(mask, 200.0, 5.0), rng), mask


def _steep_background() -> tuple[NDArray[np.uint16], Mask]:
    """Objects on a background that rises to three times their own height."""
    rng = _rng("steep")
    mask = _balls(rng, 45, (1.0, 1.8))
    _, _, x = _axes()
    ground = 10 + 180 * (x / x.max()) ** 2 * np.ones(SHAPE)
    return CAMERAS["scmos"].shoot(_seen(mask, 60.0, ground), rng), mask


def _saturated() -> tuple[NDArray[np.uint16], Mask]:
    """Objects that saturate the detector."""
    rng = _rng("saturated")
    mask = _balls(rng, 45, (1.0, 1.8))
    camera = Camera(gain=40.0, offset=100, read_noise=1.6, largest=4095)
    height = 60 * np.exp(0.8 * _texture(rng, 10.0))
    return camera.shoot(_seen(mask, height, 5.0), rng), mask


def _eight_bit() -> tuple[NDArray[np.uint8], Mask]:
    """An 8-bit confocal stack, in which most of the background is 0."""
    rng = _rng("eight bit")
    mask = _balls(rng, 45, (1.0, 1.8))
    voxels = CAMERAS["detector"].shoot(_seen(mask, 18.0, 0.6), rng)
    return voxels.astype(np.uint8), mask


def _stitched() -> tuple[NDArray[np.uint16], Mask]:
    """Two fields of view side by side, one of them with 1.6 times the light."""
    rng = _rng("stitched")
    mask = _balls(rng, 45, (1.0, 1.8))
    light = np.where(np.arange(SHAPE[2]) < SHAPE[2] // 2, 1.0, 1.6)[None, None]
    return CAMERAS["scmos"].shoot(_seen(mask, 60.0, 12.0) * light, rng), mask


def _tissue(share_of_light: float) -> tuple[NDArray[np.uint16], Mask]:
    """A piece of tissue with a wavy rim, texture inside, and weak autofluorescence outside."""
    rng = _rng(f"tissue {share_of_light}")
    z, y, x = _axes()
    rim = 11 + 2.5 * np.sin(y / 3) + 1.5 * np.cos(z / 2)
    mask = np.broadcast_to(x < rim, SHAPE).copy()
    height = 40 * np.exp(0.35 * _texture(rng, 6.0)) * share_of_light
    return CAMERAS["scmos"].shoot(_seen(mask, height, 4.0), rng), mask


def _shells() -> tuple[NDArray[np.uint16], Mask]:
    """Membranes between touching cells, one and a half voxels thick."""
    rng = _rng("shells")
    seeds = rng.uniform(0, 1, (60, 3)) * (np.array(SHAPE) * SPACING)
    z, y, x = _axes()
    away = np.full((2, *SHAPE), np.inf)
    for seed in seeds:
        d = np.sqrt((z - seed[0]) ** 2 + (y - seed[1]) ** 2 + (x - seed[2]) ** 2)
        nearer = d < away[0]
        away[1] = np.where(nearer, away[0], np.minimum(away[1], d))
        away[0] = np.where(nearer, d, away[0])
    mask = away[1] - away[0] < 0.42
    return CAMERAS["scmos"].shoot(_seen(mask, 90.0, 8.0), rng), mask


def _nested(photons: float, times: float) -> tuple[NDArray[np.uint16], Mask]:
    """Cells whose nuclei are `times` as bright as the cells; the truth is the nuclei."""
    rng = _rng(f"nested {photons} {times}")
    z, y, x = _axes()
    cells, nuclei = np.zeros(SHAPE, bool), np.zeros(SHAPE, bool)
    for _ in range(14):
        r = rng.uniform(2.2, 3.2)
        c = [rng.uniform(1.5, n * h - 1.5) for n, h in zip(SHAPE, SPACING, strict=True)]
        away = np.sqrt((z - c[0]) ** 2 + (y - c[1]) ** 2 + (x - c[2]) ** 2)
        cells |= away < r
        nuclei |= away < r * rng.uniform(0.45, 0.6)
    height = photons * np.where(nuclei, times, 1.0)
    return CAMERAS["scmos"].shoot(_seen(cells, height, 0.1 * photons), rng), nuclei


def nested_cases() -> Iterator[Case]:
    """Yield cells with nuclei. The truth is the second level; every other case is held out."""
    for count, (photons, times) in enumerate(product((10.0, 40.0, 160.0), (1.5, 2.5, 5.0))):
        yield Case(
            f"nested, {photons:g} photons, x {times:g}",
            "nested",
            SPACING,
            partial(_nested, photons, times),
            held_out=count % 2 == 1,
            level=1,
        )


def _case_of(name: str, make: Callable[[], tuple[NDArray[Any], Mask]], held_out: bool) -> Case:
    return Case(name, "made", SPACING, make, held_out=held_out)


def made_cases() -> Iterator[Case]:
    """Yield the volumes with objects."""
    for name, make, held_out in (
        ("two classes", _two_classes, False),
        ("one blob", _blob, False),
        ("steep background", _steep_background, False),
        ("saturated", _saturated, True),
        ("eight bit", _eight_bit, False),
        ("stitched", _stitched, True),
        ("tissue", lambda: _tissue(1.0), False),
        ("dim tissue", lambda: _tissue(0.4), True),
        ("shells", _shells, False),
        ("bodies in depth", _bodies_in_depth, True),
        ("slab", _slab, True),
        ("straight edge", lambda: _straight_edge(0.0), True),
        ("edge at 5 degrees", lambda: _straight_edge(5.0), True),
    ):
        yield _case_of(name, make, held_out)


def family_cases() -> Iterator[Case]:
    """Yield two thirds of the family of balls, tubes and membranes; half of them are held out."""
    for number, member in enumerate(iso_value_family.family()):
        if number % 3 == 2:
            continue

        def load(member: iso_value_family.Member = member) -> tuple[NDArray[Any], Mask]:
            truth, counts = iso_value_family.make(member, seed=0)
            return counts, truth

        name = (
            f"{member.kind}, {member.share:.0%}, x {member.brightest:g}, {member.photons:g} photons"
            f"{', uneven' if member.background else ''}"
        )
        yield Case(name, "made", iso_value_family.SPACING, load, held_out=number % 3 == 1)


def empty_cases() -> Iterator[Case]:
    """Yield the volumes without a surface to find; every other one is held out."""
    makers: dict[str, Callable[[], NDArray[Any]]] = {
        f"empty, counted photons, {photons:g}": partial(_counted, photons)
        for photons in (0.05, 0.3, 3.0)
    }
    makers |= {f"empty, clipped at {-offset:g}": partial(_clipped, offset) for offset in (-10, -15)}
    for camera in CAMERAS:
        makers |= {f"empty, {camera}, {one}": partial(_empty, camera, one) for one in FAULTS}
        makers |= {f"empty, {camera}, {one}": partial(_uneven_light, camera, one) for one in LIGHTS}
        makers |= {
            f"empty, {camera}, {one}": partial(_hard_light, camera, one) for one in HARD_LIGHTS
        }
        makers |= {
            f"inside tissue, {camera}, {sigma:g}": partial(_inside_tissue, camera, sigma)
            for sigma in (2.0, 6.0)
        }
    for count, (name, make) in enumerate(makers.items()):
        yield Case(
            name, "empty", SPACING, lambda make=make: (make(), None), held_out=count % 2 == 1
        )
