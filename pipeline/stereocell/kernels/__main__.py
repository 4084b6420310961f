"""Compile all kernels, so that no build waits for it: `python -m stereocell.kernels`."""

import gc
import sys

from stereocell.kernels.compile_all import OF_MESHES, compile_all, compile_of_meshes

gc.disable()  # numba keeps nearly all that it makes: the collector would take a tenth of the time
if sys.argv[1:] == [OF_MESHES]:
    compile_of_meshes()
else:
    compile_all()
