"""MRC and CCP4 maps."""

from stereocell.read.format import Format, Guide
from stereocell.read.image import Image
from stereocell.read.known_formats import identify
from stereocell.storage.first_bytes import Mark
from stereocell.storage.location import Location


def _open(location: Location) -> Image:
    from stereocell.read.formats.mrc.image import read_image

    return read_image(location)


def _is_unmarked(_path: str, head: bytes) -> bool:
    """Return whether a file may be MRC without a mark: before 2000, or compressed."""
    content = identify(head)
    return not content.is_known or content.format == "mrc.gz" or head.startswith(b"BZh")


FORMAT = Format(
    title="MRC",
    open=_open,
    endings=tuple(
        ending + packed
        for ending in (".mrc", ".rec", ".map", ".mrcs", ".ccp4")
        for packed in ("", ".gz", ".bz2")
    ),
    marks=(Mark("an MRC file", rb"MAP ", at=208),),  # IMOD names MRC .st, .ali, ...
    is_unmarked=_is_unmarked,
    guides=(
        Guide(
            "MRC, CCP4",
            "`NAME.mrc`, `.rec`, `.map`, also `.gz`, `.bz2`",
            "[MRC and CCP4](input-volumes.md)",
        ),
    ),
)
