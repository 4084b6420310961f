"""Leica LIF."""

from stereocell.read.format import Format, Guide, Library
from stereocell.read.image import Image
from stereocell.storage.first_bytes import Mark
from stereocell.storage.location import Location


def _open(location: Location, *, series: int = 0) -> Image:
    from stereocell.read.formats.lif.image import read_image

    return read_image(location, series=series)


def _list_series(location: Location) -> tuple[str, ...]:
    from stereocell.read.formats.lif.image import list_series

    return list_series(location)


FORMAT = Format(
    title="LIF",
    open=_open,
    list_series=_list_series,
    library=Library("liffile", extra="lif", reads=".lif (Leica)"),
    endings=(".lif",),
    marks=(Mark("a LIF file of Leica", rb"\x70\0\0\0....\x2a"),),
    guides=(Guide("Leica LIF", "`NAME.lif`", "[CZI, LIF, ND2 and Imaris](input-microscopes.md)"),),
)
