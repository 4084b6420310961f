"""Names of primvars on the meshes of a stage."""

OBJECT_ID = "objectId"  # primvar: the place of a face's object in LABELS
PAINT = "paint"  # primvar: intensity of the sampled channel at each vertex, 0..1
# names of primvars that mean something else on a mesh, to us or to DCC tools
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
