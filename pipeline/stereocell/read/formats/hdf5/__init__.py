"""HDF5, netCDF-4, MATLAB 7.3 and EMD."""

from typing import Any

from stereocell.read.chunk_counts import Absent, Spans
from stereocell.read.format import Format, Guide, Library
from stereocell.read.hdf5_file.signature import SIGNATURE, is_hdf5
from stereocell.read.image import Image
from stereocell.storage.file_states import FileStates
from stereocell.storage.first_bytes import Mark
from stereocell.storage.location import Location


def _open(location: Location, *, axes: str = "") -> Image:
    from stereocell.read.formats.hdf5.image import read_image

    return read_image(location, axes=axes)


def _count_absent(stored: Any, spans: Spans, states: FileStates) -> Absent | None:
    from stereocell.read.formats.hdf5.absent import count_absent

    return count_absent(stored, spans, states)


FORMAT = Format(
    title="HDF5 (NAME.h5:/KEY)",
    open=_open,
    has_axes=True,
    has_parts=True,
    endings=(".h5", ".hdf5", ".hdf", ".nc", ".nc4", ".mat", ".emd"),
    marks=(
        Mark("an HDF5 file", SIGNATURE),
        Mark("a MATLAB 7.3 file", rb"MATLAB 7\.3"),  # HDF5 after a block of 512 bytes
    ),
    is_unmarked=is_hdf5,
    decoders=Library(
        "hdf5plugin", extra="hdf5", reads="HDF5 packed by Blosc, zstd, LZ4 and others"
    ),
    count_absent=_count_absent,
    guides=(
        Guide(
            "HDF5, netCDF-4, MATLAB 7.3, EMD",
            "`NAME.h5:/KEY`, `NAME.nc`, `NAME.mat`, `NAME.emd`",
            "[HDF5](input-hdf5.md)",
        ),
    ),
)
