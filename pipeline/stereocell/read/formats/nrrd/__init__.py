"""NRRD."""

from stereocell.read.format import Format, Guide
from stereocell.read.image import Image
from stereocell.storage.first_bytes import Mark
from stereocell.storage.location import Location


def _open(location: Location) -> Image:
    from stereocell.read.formats.nrrd.image import read_image

    return read_image(location)


def _is_unmarked(_path: str, head: bytes) -> bool:
    """The reader names an unknown version."""
    return head.startswith(b"NRRD")


FORMAT = Format(
    title="NRRD",
    open=_open,
    endings=(".nrrd", ".nhdr"),
    marks=(Mark("an NRRD file", rb"NRRD0"),),
    is_unmarked=_is_unmarked,
    guides=(
        Guide(
            "NRRD",
            "`NAME.nrrd`, `NAME.nhdr`",
            (
                "raw, gzip, bzip2. Where `space` names axes of the body the image lies in the "
                "patient, as [NIfTI](dicom.md) does, in mm unless `space units` or `units` says "
                "otherwise; else it is a stack, whose spacing is in these units, and whose axes "
                "stand in the order of their `labels` (z, y, x, depth, ...). An axis of `kinds` "
                "time is time, one without direction is channels: a note says which values they "
                "are, and parts of vectors, tensors and colours have their names. Images of "
                "diffusion (`DWMRI_gradient`, `DWMRI_B-matrix`) count as points in time, b 0 "
                "first, and a note names the b-values"
            ),
        ),
    ),
)
