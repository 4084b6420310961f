"""Nikon's ND2."""

from stereocell.read.format import Format, Guide, Library
from stereocell.read.image import Image
from stereocell.storage.first_bytes import Mark
from stereocell.storage.location import Location


def _open(location: Location, *, series: int = 0) -> Image:
    from stereocell.read.formats.nd2.image import read_image

    return read_image(location, series=series)


def _list_series(location: Location) -> tuple[str, ...]:
    from stereocell.read.formats.nd2.image import list_series

    return list_series(location)


def _is_old(_path: str, head: bytes) -> bool:
    """Return whether a file is JPEG 2000, as ND2 was before 2006."""
    return head.startswith(b"\0\0\0\x0cjP  ")


FORMAT = Format(
    title="ND2",
    open=_open,
    list_series=_list_series,
    library=Library("nd2", extra="nd2", reads=".nd2 (Nikon)"),
    endings=(".nd2",),
    marks=(Mark("an ND2 file of Nikon", rb"\xda\xce\xbe\x0a"),),
    is_unmarked=_is_old,
    guides=(Guide("Nikon ND2", "`NAME.nd2`", "[CZI, LIF, ND2 and Imaris](input-microscopes.md)"),),
)
