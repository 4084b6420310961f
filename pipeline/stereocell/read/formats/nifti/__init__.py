"""NIfTI and Analyze."""

from stereocell.read.format import Format, Guide
from stereocell.read.image import Image
from stereocell.read.known_formats import is_unknown
from stereocell.storage.first_bytes import Mark
from stereocell.storage.location import Location


def _open(location: Location) -> Image:
    from stereocell.read.formats.nifti.image import read_image

    return read_image(location)


def _is_unmarked(path: str, head: bytes) -> bool:
    """Return whether a file may have no mark: Analyze has none, nor have the voxels of a pair."""
    return path.lower().endswith((".img", ".img.gz")) or is_unknown(path, head)


FORMAT = Format(
    title="NIfTI or Analyze",
    open=_open,
    endings=(".nii", ".nii.gz"),
    loose_endings=(".hdr", ".img", ".hdr.gz", ".img.gz"),  # endings of Analyze, and of NIfTI pairs
    packed_endings=(".nii.gz", ".hdr.gz"),
    marks=(
        Mark("a NIfTI file", rb"n[+i]1\0", at=344),
        Mark("a NIfTI-2 file", rb"n[+i]2\0\r\n", at=4),
    ),
    needs_ending=True,
    is_unmarked=_is_unmarked,
    guides=(
        Guide(
            "NIfTI-1, NIfTI-2",
            "`NAME.nii`, `NAME.nii.gz`; a pair `NAME.hdr`, `NAME.img`",
            "[DICOM and NIfTI](dicom.md)",
        ),
        Guide(
            "Analyze 7.5",
            "`NAME.hdr` or `NAME.img`, also `.gz`",
            "as NIfTI, without an orientation",
        ),
    ),
)
