"""Loops over voxels and triangles, compiled once a machine by numba; no file, no other package."""
