"""FreeSurfer's MGH: .mgh, and packed by gzip as .mgz, read with the parts that read NIfTI.

The voxels are big-endian and have no scale; the centre of the volume lies at `Pxyz_c`, in RAS, in
mm. Behind the voxels stand command lines with names of files and users, which are not read.

References: https://surfer.nmr.mgh.harvard.edu/fswiki/FsTutorial/MghFormat
"""

from stereocell.read.formats.nifti import image as nifti
from stereocell.read.image import Image
from stereocell.storage.location import Location


def read_image(location: Location) -> Image:
    """Return the volume of the file, with all its frames as time points. Raises SourceError."""
    return nifti.read_image(location)
