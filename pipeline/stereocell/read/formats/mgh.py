"""Read FreeSurfer's MGH (.mgh, and .mgz compressed by gzip) with the modules that read NIfTI.

The voxels are big-endian and have no scale. The centre of the volume lies at `Pxyz_c`, in RAS, in
mm. Command lines with names of files and users follow the voxels; they are not read.

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
