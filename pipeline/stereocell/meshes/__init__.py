"""Triangle meshes: simplification, exact validity, volumes, distances.

A body is a connected component of a mesh.
"""
