"""Imaris files, which are HDF5."""

from stereocell.read.format import Format, Guide
from stereocell.read.hdf5_file.signature import is_hdf5
from stereocell.read.image import Image
from stereocell.storage.location import Location


def _open(location: Location) -> Image:
    from stereocell.read.formats.ims.image import read_image

    return read_image(location)


FORMAT = Format(
    title="Imaris",
    open=_open,
    endings=(".ims",),
    is_unmarked=is_hdf5,
    guides=(Guide("Imaris 5.5", "`NAME.ims`", "[CZI, LIF, ND2 and Imaris](input-microscopes.md)"),),
)
