"""Write the source of the viewer's tests of `stereocell view`: the letter F, in a file.

python -m support.live_source FILE.ome.tif [SCALE]

SCALE is the number of voxels along each edge of a voxel of the smallest F; 2 by default.
"""

import sys
from pathlib import Path

from support.phantoms import f_phantom, write_ome_tiff

if __name__ == "__main__":
    path, *scale = sys.argv[1:]
    write_ome_tiff(Path(path), f_phantom(int(*scale or [2])), spacing=(1.0, 0.5, 0.5))
