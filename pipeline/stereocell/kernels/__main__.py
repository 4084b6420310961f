"""Compile all kernels in advance, so that no build waits: `python -m stereocell.kernels`."""

import gc
import sys

from stereocell.kernels.compile_all import OF_MESHES, compile_all, compile_of_meshes

gc.disable()  # numba keeps nearly all its objects, so collecting would take a tenth of the time
if sys.argv[1:] == [OF_MESHES]:
    compile_of_meshes()
else:
    compile_all()
