"""MetaImage, ITK's format."""

from stereocell.read.format import Format, Guide
from stereocell.read.image import Image
from stereocell.read.known_formats import identify
from stereocell.storage.first_bytes import TEXT, Mark
from stereocell.storage.location import Location


def _open(location: Location) -> Image:
    from stereocell.read.formats.metaimage.image import read_image

    return read_image(location)


def _may_be_text(_path: str, head: bytes) -> bool:
    content = identify(head)
    return not content.is_known or content.words == TEXT


FORMAT = Format(
    title="MetaImage",
    open=_open,
    endings=(".mha", ".mhd"),
    marks=(
        Mark(
            "the header of a MetaImage",
            rb"\s*(ObjectType|Comment|NDims|ObjectSubType|TransformType)\s*=",
        ),
    ),
    needs_ending=True,
    is_unmarked=_may_be_text,
    guides=(
        Guide("MetaImage", "`NAME.mha`, `NAME.mhd`", "[NRRD and MetaImage](input-volumes.md)"),
    ),
)
