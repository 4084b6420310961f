"""Convolution kernels of CT for the user: makers' codes, never free text.

A kernel may have several values: newer Siemens scanners add the strength of the iterative
reconstruction, such as `Br40d\\3`.

References: DICOM PS3.3 C.8.2.1 (CT Image module).
"""

import re

from stereocell.read.formats.dicom.frame import Frame

# Siemens `B30f`, `Br40d`; Canon `FC08`, `FC18-H`; Philips `YB`, `EB`; GE `LUNG`
_KERNEL = re.compile(
    r"[A-Z][a-z]?\d{1,3}[a-z]?|FC\d\d(-H)?|[YEU]?[A-E]"
    r"|STANDARD|SOFT|DETAIL|CHEST|LUNG|BONE(PLUS)?|EDGE|ULTRA"
)
_STRENGTH = re.compile(r"Q?\d")  # strength of the iterative reconstruction, beside the kernel
_SHARP = re.compile(r"DETAIL|CHEST|LUNG|BONE(PLUS)?|EDGE|ULTRA")  # GE's edge-sharpening kernels


def kernel_of(frame: Frame) -> tuple[bool, tuple[str, ...]]:
    """Return a value that sorts soft kernels first, as the numbers in other makers' codes do."""
    kernel = frame.kind.kernel
    return bool(kernel) and _SHARP.fullmatch(kernel[0]) is not None, kernel


def kernel_words(value: tuple[bool, tuple[str, ...]], place: int) -> str:
    """Return a kernel's code and strength; a kernel in another form is numbered.

    place  index of the kernel among the others
    """
    _, kernel = value
    if not kernel:
        return "no kernel stated"
    code, *others = kernel
    if not _KERNEL.fullmatch(code):
        return f"kernel no. {place + 1}"
    return " ".join(["kernel", code, *filter(_STRENGTH.fullmatch, others)])
