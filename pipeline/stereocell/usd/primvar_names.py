"""Names of primvars on the meshes of a stage."""

OBJECT_ID = "objectId"  # primvar: index of a face's object in LABELS of write_objects.py
PAINT = "paint"  # primvar, 0..1: intensity of the sampled channel at each vertex
# Names that a column of an object table can't have: the stage or DCC tools use them otherwise
RESERVED = frozenset(
    (
        OBJECT_ID,
        PAINT,
        "displayColor",
        "displayOpacity",
        "normals",
        "occlusion",
        "st",
        "tangents",
        "points",
    )
)
