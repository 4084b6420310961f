"""Compile all kernels, so that no build waits for it: `python -m stereocell.kernels`."""

import gc
import sys

from stereocell.kernels.compile_all import OF_MESHES, compile_all, compile_of_meshes

gc.disable()  # to look through what numba keeps anyway takes a tenth of the time
if sys.argv[1:] == [OF_MESHES]:
    compile_of_meshes()
else:
    compile_all()
