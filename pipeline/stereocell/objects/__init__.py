"""Objects from label maps, in which each voxel holds its object's number."""
