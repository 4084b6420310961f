"""NRRD."""

from stereocell.read.format import Format, Guide
from stereocell.read.image import Image
from stereocell.storage.first_bytes import Mark
from stereocell.storage.location import Location


def _open(location: Location) -> Image:
    from stereocell.read.formats.nrrd.image import read_image

    return read_image(location)


def _is_unmarked(_path: str, head: bytes) -> bool:
    """Return whether a file is NRRD of any version: the reader names an unknown one."""
    return head.startswith(b"NRRD")


FORMAT = Format(
    title="NRRD",
    open=_open,
    endings=(".nrrd", ".nhdr"),
    marks=(Mark("an NRRD file", rb"NRRD0"),),
    is_unmarked=_is_unmarked,
    guides=(Guide("NRRD", "`NAME.nrrd`, `NAME.nhdr`", "[NRRD and MetaImage](input-volumes.md)"),),
)
