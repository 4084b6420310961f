"""Objects of label maps, in which each voxel holds the number of its object."""
