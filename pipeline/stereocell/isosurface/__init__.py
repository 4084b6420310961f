"""From voxels to a surface: iso-value, distance field, repair and extraction."""
