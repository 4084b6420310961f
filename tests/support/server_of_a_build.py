"""A process with an idle build, to be killed: `python -m support.server_of_a_build FOLDER`.

The number of the build's process is written to FOLDER/build.
"""

import sys
import time
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from stereocell.live.build_process import BuildProcess, Coarse
from support import fake_build

if __name__ == "__main__":
    folder = Path(sys.argv[1])
    nothing: Any = SimpleNamespace(tiles=())
    process = BuildProcess(partial(fake_build.endless, folder), folder / "out")
    process.start(Coarse(nothing, {}, folder / "out", folder, {}))
    while not (folder / "build").exists():
        time.sleep(0.01)
    while True:
        process.rest()
        time.sleep(0.1)
