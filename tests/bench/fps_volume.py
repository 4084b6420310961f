"""Write the head phantom for `make bench-fps`: fps_volume.py OUT EDGE.

OUT is an OME-TIFF of a cube with EDGE voxels a side.
"""

import os
import sys
from pathlib import Path

from stereocell.samples.head import make_head

sys.path.insert(0, str(Path(__file__).parents[1]))
from support.phantoms import write_ome_tiff


def main(out: Path, edge: int) -> None:
    head = make_head(shape=(edge, edge, edge))
    temporary = out.with_name(f"{out.name}.part")
    write_ome_tiff(temporary, head.voxels, spacing=head.spacing_um, names=["T1"], compression=None)
    os.replace(temporary, out)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
