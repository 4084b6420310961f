"""FreeSurfer's MGH: .mgh, and packed by gzip as .mgz, read with the parts that read NIfTI.

The voxels are big-endian and have no scale; the centre of the volume lies at `Pxyz_c`, in RAS, in
mm. Behind the voxels stand command lines with names of files and users, which are not read.

References: https://surfer.nmr.mgh.harvard.edu/fswiki/FsTutorial/MghFormat
"""

from stereocell.read.format import Format, Guide
from stereocell.read.image import Image
from stereocell.read.known_formats import is_unknown
from stereocell.storage.location import Location


def _open(location: Location) -> Image:
    """Return the volume of the file, with all its frames as time points. Raises SourceError."""
    from stereocell.read.formats.nifti.image import read_image

    return read_image(location)


FORMAT = Format(
    title="MGH (FreeSurfer)",
    open=_open,
    endings=(".mgh", ".mgz", ".mgh.gz"),
    packed_endings=(".mgz", ".mgh.gz"),
    is_unmarked=is_unknown,  # MGH has no mark
    guides=(Guide("MGH (FreeSurfer)", "`NAME.mgz`, `NAME.mgh`", "as NIfTI"),),
)
