"""CZI of Zeiss."""

from stereocell.read.format import Format, Guide, Library
from stereocell.read.image import Image
from stereocell.storage.first_bytes import Mark
from stereocell.storage.location import Location


def _open(location: Location, *, series: int = 0) -> Image:
    from stereocell.read.formats.czi.image import read_image

    return read_image(location, series=series)


def _list_series(location: Location) -> tuple[str, ...]:
    from stereocell.read.formats.czi.image import list_series

    return list_series(location)


FORMAT = Format(
    title="CZI",
    open=_open,
    list_series=_list_series,
    library=Library("pylibCZIrw", extra="czi", reads=".czi (Zeiss)"),
    endings=(".czi",),
    marks=(Mark("a CZI file of Zeiss", rb"ZISRAWFILE"),),
    guides=(Guide("Zeiss CZI", "`NAME.czi`", "[CZI, LIF, ND2 and Imaris](input-microscopes.md)"),),
)
