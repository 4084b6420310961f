"""Loops over voxels and triangles that numba compiles once on each machine."""
