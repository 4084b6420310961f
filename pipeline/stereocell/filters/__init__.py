"""Filters from voxels to voxels: noise, background, mip levels, and value ranges of bricks."""
