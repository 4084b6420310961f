"""UVs of a mesh, and the maps that are baked for them."""
