"""Write a bundle's page in one file, for tests of the viewer.

    python -m support.scene_page BUNDLE FILE [MAX_MB [VIEW]]

Prints the line that the export reports.
"""

import sys
from pathlib import Path

from stereocell.export.scene import MAX_MB, write_scene

if __name__ == "__main__":
    bundle, file, *more = sys.argv[1:]
    max_mb = float(more[0]) if more else MAX_MB
    view = more[1] if len(more) > 1 else ""
    print(write_scene(Path(bundle), Path(file), max_mb=max_mb, view=view))
