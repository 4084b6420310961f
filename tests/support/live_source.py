"""Write the source of the viewer's tests of `stereocell view`: the letter F, in a file.

python -m support.live_source FILE.ome.tif
"""

import sys
from pathlib import Path

from support.phantoms import f_phantom, write_ome_tiff

if __name__ == "__main__":
    write_ome_tiff(Path(sys.argv[1]), f_phantom(2), spacing=(1.0, 0.5, 0.5))
