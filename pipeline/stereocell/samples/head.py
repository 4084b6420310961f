"""A head in T1-weighted MRI, made of ellipsoids, and its ground truth.

It follows the phantom of Shepp & Logan, in its 3D form by Kak & Slaney (table 3.2) and its MRI form
by Gach, Tanase & Boada. The outer ellipsoid and the two tilted, unequal ventricles have the
proportions of that table, with 104 mm as the unit. The tissues are a head's, and the surfaces of
grey and white matter are folded. The head has no mirror symmetry: nose and eyes are in front, the
neck below, and a capsule of oil on the left temple. Radiographers tape such a capsule there to mark
the side.

Bodies are painted one over the other. Each covers a share of a voxel, by a ramp one voxel wide over
its surface; hence the truth is also known as shares. The bias field of a receive coil multiplies
the signal. Noise is Rician, as in magnitude images.

References: Shepp & Logan, "The Fourier reconstruction of a head section", IEEE Transactions on
Nuclear Science 21(3), 1974, https://doi.org/10.1109/TNS.1974.6499235
Kak & Slaney, Principles of Computerized Tomographic Imaging, IEEE Press, 1988
Gach, Tanase & Boada, "2D & 3D Shepp-Logan phantom standards for MRI", International Conference on
Systems Engineering, 2008, https://doi.org/10.1109/ICSEng.2008.15
Gudbjartsson & Patz, "The Rician distribution of noisy MRI data", Magnetic Resonance in Medicine
34(6), 1995, https://doi.org/10.1002/mrm.1910340618
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stereocell.model.errors import UsageError

Triple = tuple[float, float, float]
Field = NDArray[np.float32]

SHAPE = (112, 96, 96)  # voxels (z, y, x)
FIELD_MM: Triple = (224.0, 192.0, 201.6)  # mm (z, y, x), field of view for every shape
BACKGROUND, CSF, GREY, WHITE, OTHER = range(5)
CLASSES = ("background", "CSF", "grey", "white", "other")
WHITE_LEVEL = 1000.0  # voxel value of white matter, without bias


@dataclass(frozen=True, slots=True)
class Body:
    """A part of the head phantom, which is an ellipsoid.

    label      class of the tissue, BACKGROUND to OTHER
    signal     signal of the tissue, as a share of white matter's
    center     mm from the middle of the field of view (z, y, x): to the front, down, to the
               patient's left
    semi_axes  mm (z, y, x)
    turn       degrees about the y axis; a positive angle turns the front end to the left
    fold_mm    mm, amplitude of the surface's folds
    """

    name: str
    label: int
    signal: float
    center: Triple
    semi_axes: Triple
    turn: float = 0.0
    fold_mm: float = 0.0


# Bodies in the order of painting; later bodies cover earlier ones.
BODIES = (
    Body("neck", OTHER, 0.55, (-22, 75, 0), (44, 62, 42)),
    Body("nose", OTHER, 0.70, (92, 22, 0), (18, 20, 12)),
    Body("capsule", OTHER, 1.20, (12, -18, 76), (9, 6, 6)),
    Body("skin", OTHER, 0.75, (0, 0, 0), (95.7, 84.2, 71.8)),
    Body("skull", OTHER, 0.08, (-1.9, -1, 0), (88, 77, 65)),
    Body("CSF", CSF, 0.30, (-1.9, -1, 0), (80, 69, 57.5)),
    Body("right eye", OTHER, 0.22, (84, 12, -30), (11, 11, 11)),
    Body("left eye", OTHER, 0.22, (84, 12, 30), (11, 11, 11)),
    Body("cortex", GREY, 0.62, (-2, -3, 0), (73, 61, 51), fold_mm=1.5),
    Body("white matter", WHITE, 1.00, (-2, -3, 0), (62, 51, 41), fold_mm=3.5),
    Body("cerebellum", GREY, 0.62, (-38, 36, 0), (24, 17, 34)),
    Body("its white matter", WHITE, 1.00, (-37, 36, 0), (15, 9, 24)),
    Body("brain stem", WHITE, 1.00, (-12, 40, 0), (10, 26, 10)),
    Body("right thalamus", GREY, 0.62, (-6, 10, -12), (15, 10, 8)),
    Body("left thalamus", GREY, 0.62, (-6, 10, 12), (15, 10, 8)),
    Body("right putamen", GREY, 0.62, (10, 8, -29), (17, 11, 6), turn=-12),
    Body("left putamen", GREY, 0.62, (10, 8, 29), (17, 11, 6), turn=12),
    Body("right ventricle", CSF, 0.30, (0, -12, -15), (30, 11, 8), turn=-18),
    Body("left ventricle", CSF, 0.30, (0, -12, 14), (24, 9, 6.5), turn=18),
    Body("lesion", GREY, 0.62, (30, -22, 20), (5, 5, 5)),
)


@dataclass(frozen=True, slots=True)
class HeadPhantom:
    """A head in the pipeline's axes: z to the front, y down, x to the patient's left.

    voxels      uint16 (z, y, x), with bias field and noise
    spacing_um  (z, y, x), um
    labels      uint8 (z, y, x), class (BACKGROUND to OTHER) that covers most of the voxel
    fractions   float32 (class, z, y, x), share of each voxel that each class covers, 0..1
    bias        float32 (z, y, x), factor of the signal, with a mean of about 1
    """

    voxels: NDArray[np.uint16]
    spacing_um: Triple
    labels: NDArray[np.uint8]
    fractions: Field
    bias: Field


def make_head(
    *, shape: tuple[int, int, int] = SHAPE, noise: float = 0.05, bias: float = 0.2, seed: int = 1
) -> HeadPhantom:
    """Return the head in `shape` (z, y, x) voxels. The field of view is the same for each shape.

    noise  sigma of each of the two receive channels, as a share of white matter's signal
    bias   range of the bias field; 0.2 means 0.9 to 1.1, as in BrainWeb

    The same arguments give the same voxels. Raises UsageError for arguments out of range.
    """
    _check(shape, noise, bias, seed)
    spacing = tuple(length / n for length, n in zip(FIELD_MM, shape, strict=True))
    axes = [
        ((np.arange(n) - (n - 1) / 2) * h).astype(np.float32)
        for n, h in zip(shape, spacing, strict=True)
    ]
    width = float(np.mean(spacing))
    signal = np.zeros(shape, np.float32)
    fractions = np.zeros((len(CLASSES), *shape), np.float32)
    fractions[BACKGROUND] = 1
    for body in BODIES:
        box = tuple(_reach(axis, body, k, width) for k, axis in enumerate(axes))
        inside = [axis[part] for axis, part in zip(axes, box, strict=True)]
        covered = np.clip(0.5 - _distance(body, inside) / width, 0, 1)
        signal[box] += covered * (np.float32(body.signal) - signal[box])
        here = fractions[(slice(None), *box)]
        here *= 1 - covered
        here[body.label] += covered
    field = _bias(axes, bias)
    rng = np.random.default_rng(seed)
    real, imaginary = (rng.standard_normal(shape, np.float32) * np.float32(noise) for _ in range(2))
    recorded = np.hypot(signal * field + real, imaginary) * WHITE_LEVEL
    return HeadPhantom(
        np.round(np.clip(recorded, 0, 4095)).astype(np.uint16),
        (spacing[0] * 1000, spacing[1] * 1000, spacing[2] * 1000),
        fractions.argmax(axis=0).astype(np.uint8),
        fractions,
        field,
    )


def _check(shape: tuple[int, int, int], noise: float, bias: float, seed: int) -> None:
    if len(shape) != 3 or not all(16 <= n <= 1024 for n in shape):
        raise UsageError(f"shape is {shape}, expected z, y, x of 16 to 1024 voxels each")
    for name, value in (("noise", noise), ("bias", bias)):
        if not 0 <= value <= 1:
            raise UsageError(f"{name} is {value:g}, expected a share from 0 to 1")
    if seed < 0:
        raise UsageError(f"seed is {seed}, expected 0 or more")


def _reach(axis: Field, body: Body, k: int, width: float) -> slice:
    """Return the range of indices along axis k that a body may cover.

    axis  coordinates (n,) along axis k, mm
    """
    radius = max(body.semi_axes) if body.turn and k != 1 else body.semi_axes[k]
    reach = radius + body.fold_mm + width
    ends = (body.center[k] - reach, body.center[k] + reach)
    first, stop = np.searchsorted(axis, ends)
    return slice(int(first), int(stop))


def _distance(body: Body, axes: list[Field]) -> Field:
    """Return the approximate signed distance to a body's surface, mm, float32 (z, y, x).

    axes  coordinates (n,) along z, y, x, mm

    The distance is negative inside. It is a first-order approximation: the value of the ellipsoid's
    implicit function divided by its gradient.
    """
    z, y, x = np.meshgrid(
        *(axis - np.float32(c) for axis, c in zip(axes, body.center, strict=True)),
        indexing="ij", sparse=True,
    )  # fmt: skip
    angle = np.deg2rad(np.float32(body.turn))
    cos, sin = np.cos(angle), np.sin(angle)
    points = (cos * z + sin * x, y, cos * x - sin * z)
    scaled = [p / np.float32(a) for p, a in zip(points, body.semi_axes, strict=True)]
    level = np.sqrt(sum((s * s for s in scaled), np.float32(0)))
    slope = np.sqrt(
        sum(
            (s * s / np.float32(a * a) for s, a in zip(scaled, body.semi_axes, strict=True)),
            np.float32(0),
        )
    )
    tiny = np.float32(1e-6)
    distance = level * (level - 1) / np.maximum(slope, tiny)
    if body.fold_mm:
        u = [s / np.maximum(level, tiny) for s in scaled]
        waves = np.cos(9 * u[0] + 1) * np.cos(8 * u[1]) + np.cos(10 * u[2] + 4 * u[1] + 0.5)
        distance += np.float32(body.fold_mm / 2) * waves
    return np.asarray(np.broadcast_to(distance, [len(a) for a in axes]), np.float32)


def _bias(axes: list[Field], share: float) -> Field:
    """Return a smooth field from 1 - share/2 to 1 + share/2, float32 (z, y, x).

    The field is brightest outside the middle.
    """
    z, y, x = np.meshgrid(
        *(axis / np.float32(length / 2) for axis, length in zip(axes, FIELD_MM, strict=True)),
        indexing="ij", sparse=True,
    )  # fmt: skip
    waves = np.cos(1.7 * z + 0.6) + 0.7 * np.sin(1.3 * y - 0.4) - 0.8 * np.cos(1.9 * x - 0.7)
    low, high = float(waves.min()), float(waves.max())
    return (1 + share * ((waves - low) / (high - low) - 0.5)).astype(np.float32)
