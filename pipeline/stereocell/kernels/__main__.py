"""Compile all kernels, so that no build waits for it: `python -m stereocell.kernels`."""

from stereocell.kernels.compile_all import compile_all

compile_all()
