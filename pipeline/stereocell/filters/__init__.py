"""Filters from voxels to voxels: noise, background, minima and maxima of bricks."""
