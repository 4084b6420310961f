"""Types of voxel spacings and of positions; without numpy, so that options start fast."""

Spacing = tuple[float, float, float]  # distance between samples in um, (z, y, x)
Point = tuple[float, float, float]  # position in um, (z, y, x)
