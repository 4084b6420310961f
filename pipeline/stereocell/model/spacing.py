"""Types of voxel spacings and positions, without numpy, so that settings import quickly."""

Spacing = tuple[float, float, float]  # distance between samples in um, (z, y, x)
Point = tuple[float, float, float]  # position in um, (z, y, x)
