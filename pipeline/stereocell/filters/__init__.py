"""Voxels in, voxels out: noise, background, minima and maxima of bricks."""
