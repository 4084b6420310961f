"""Note when a source holds no plain images, and what is built instead.

Phases, projections, subtractions and the like are listed after the images that they belong to. If
those are missing, such a series is built, and its voxels are not intensities of body tissue.
"""

from collections.abc import Callable, Iterable

from stereocell.read.formats.dicom.frame_kind import (
    IMAGINARY,
    LOCALIZER,
    OPPOSED_PHASE,
    PHASE,
    REAL,
    FrameKind,
)
from stereocell.read.formats.dicom.pet_kind import NOT_CORRECTED
from stereocell.read.formats.dicom.stack import Stack

_SIGNED = "values have a sign, and 0 means no signal"
_FLAT = "each shows many slices at once, so it has no depth"
# part of a complex signal -> name of its images, and a remark on their values
_PARTS = {
    PHASE: ("phase images", "values are angles or velocities, and noise outside a body is strong"),
    REAL: ("real parts of a complex signal", _SIGNED),
    IMAGINARY: ("imaginary parts of a complex signal", _SIGNED),
}
# role -> name of its images, and a remark on their values
_ROLES = {
    "reformatted": ("reformatted images", "they are interpolated from original slices"),
    "subtraction": ("subtraction images", "values are differences of two images"),
    "trace of diffusion": (
        "traces of diffusion",
        "they are computed from several directions",
    ),
    "parametric map": ("parametric maps", "values are computed quantities, not intensities"),
    "projection": ("projections", _FLAT),
    "maximum intensity projection": ("maximum intensity projections", _FLAT),
    "minimum intensity projection": ("minimum intensity projections", _FLAT),
    "average of a slab": ("averages of slabs", "each is computed from several slices"),
    LOCALIZER: ("localizers (scouts)", "they are few and coarse, to plan other images with"),
    "rendering": ("renderings", "values are the shades of a rendered image"),
    "screen save": ("screen saves", "values are the shades of a screen image"),
    "dose or protocol sheet": ("dose or protocol sheets", "values are those of a page of text"),
}
# contrast -> name of its images, better images that are missing, remark on the values
_CONTRASTS = {
    NOT_CORRECTED: (
        "PET images without attenuation correction",
        "corrected images are",
        "values deep in a body are too low",
    ),
    "opposed phase": (
        "opposed-phase images",
        "in-phase or water images are",
        "borders of fat and water are dark",
    ),
    "fat": ("fat images", "in-phase or water images are", "tissue without fat is dark"),
    "first inversion": (
        "images of the first inversion",
        "uniform image or second inversion is",
        "tissues may be dark or bright by their relaxation alone",
    ),
}
_CONTRASTS[OPPOSED_PHASE] = _CONTRASTS["opposed phase"]


def lesser_notes(stack: Stack, stacks: Iterable[Stack]) -> tuple[str, ...]:
    """Return a note if neither this stack nor another stack of the source holds plain images.

    stacks  all stacks of the source
    """
    first, kind = stack.first, stack.first.kind
    if first.segmentation is not None:
        return ()
    others = [
        other.first.kind
        for other in stacks
        if other.layout is not None
        and other.first.segmentation is None
        and other.first.modality == first.modality
    ]
    return tuple(
        f"{found}: no {absent} here; {remark}"
        for found, absent, remark, is_better in _lacking(kind)
        if not any(map(is_better, others))
    )


def _lacking(kind: FrameKind) -> list[tuple[str, str, str, Callable[[FrameKind], bool]]]:
    """Return what a kind lacks: its name, what is missing, a remark, and a test of other kinds."""
    found: list[tuple[str, str, str, Callable[[FrameKind], bool]]] = []
    if kind.part in _PARTS:
        name, remark = _PARTS[kind.part]
        found.append((name, "magnitude is", remark, _is_magnitude))
    if kind.role in _ROLES:
        name, remark = _ROLES[kind.role]
        found.append((name, "original images are", remark, lambda other: not other.role))
    for contrast in kind.contrasts:
        if contrast in _CONTRASTS:
            found.append((*_CONTRASTS[contrast], lambda o: _is_contrast_better(o, kind)))
    if not found and kind.is_derived:
        remark = "they were computed from other images"
        name = "derived images (ImageType DERIVED)"
        found.append((name, "original images are", remark, lambda other: not other.rank))
    return found


def _is_magnitude(other: FrameKind) -> bool:
    return other.part not in _PARTS and not other.role


def _is_contrast_better(other: FrameKind, kind: FrameKind) -> bool:
    return _is_magnitude(other) and other.contrast_rank < kind.contrast_rank
