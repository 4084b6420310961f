"""The common part of every layer of a stage: units, root prim, export to disk.

USD does not convert units between layers, so each layer states micrometres, Y up and its default
prim. Importing this module registers the codeless API schemas of schemas/usd. This must happen
before a process opens its first stage, since USD reads its schemas only then.
"""

import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from pxr import Gf, Plug, Sdf, Tf, Usd, UsdGeom, UsdUtils, Vt

from stereocell.model.errors import OutputError
from stereocell.storage.assets import find_asset
from stereocell.storage.atomic_write import replacing

METERS_PER_UNIT = 1e-6  # metres: a stage unit is 1 um
UP_AXIS = UsdGeom.Tokens.y
ROOT = Sdf.Path("/Specimen")
# A class that the root of each stage inherits. An edit of it changes all specimens of a scene.
BROADCAST = Sdf.Path("/__class__").AppendChild(ROOT.name)
# Attribute of /Specimen: the clip plane at opening, as normal (x, y, z) and offset, um, world
OPENING_CUT = "stereocell:openingCut"
# Attribute of /Specimen: scale of the specimen in display.usda, see usd/write_display.py
DISPLAY_SCALE = "stereocell:displayScale"
# Attribute of a channel: ID of another channel, whose intensity colours this channel's surfaces
PAINTED_BY = "stereocell:paintedBy"
BUILT_COLOR = "stereocellBuiltColor"  # custom data of a surface's colour: its colour after a build
CHANNELS = ROOT.AppendChild("Channels")
# Parent of one prim per channel. A channel's surfaces and volumes inherit that prim's visibility.
SHOWN = ROOT.AppendChild("Shown")
CLASSES = ROOT.AppendChild("Classes")  # for each channel, the materials of its object classes
TILES = ROOT.AppendChild("Tiles")
CAMERAS = ROOT.AppendChild("Cameras")
LIGHTS = ROOT.AppendChild("Lights")
CHANNEL_API = "StereoCellChannelAPI"
SPECIMEN_API = "StereoCellSpecimenAPI"
PATIENT_API = "StereoCellPatientAPI"
SURFACE_API = "StereoCellSurfaceAPI"

# Attributes of the tiles' group: directions (x, y, z) to the patient's sides, along its own axes
SIDES = {
    "left": "stereocell:left",
    "posterior": "stereocell:posterior",
    "superior": "stereocell:superior",
}

# Attributes of a surface's mesh: hash of its points and faces as built, and its distances from the
# iso-surface, um (99th percentile, and largest)
SHAPE_HASH = "stereocell:shapeHash"
DISTANCE = "stereocell:distance"
LARGEST_DISTANCE = "stereocell:largestDistance"
DISTANCE_SAMPLES = "stereocell:distanceSamples"

Plug.Registry().RegisterPlugins(str(find_asset("schemas/usd")))


def new_stage(suffix: str, default_prim: str) -> Usd.Stage:
    """Return a stage in memory with one layer that states units, up axis and default prim.

    Payloads are not loaded, so their files need not exist yet.
    """
    layer = Sdf.Layer.CreateAnonymous(suffix)
    layer.defaultPrim = default_prim
    stage = Usd.Stage.Open(layer, Usd.Stage.LoadNone)
    UsdGeom.SetStageMetersPerUnit(stage, METERS_PER_UNIT)
    UsdGeom.SetStageUpAxis(stage, UP_AXIS)
    return stage


def is_layer(file: Path) -> bool:
    """Return whether USD can open a file as a layer. Reads the file, never USD's cache."""
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # hides USD's long output on a damaged layer
    try:
        return Sdf.Layer.OpenAsAnonymous(str(file)) is not None
    except Tf.ErrorException:
        return False
    finally:
        del quiet


def export(layer: Sdf.Layer, path: Path) -> None:
    """Write a layer atomically: on failure, no partial file is left. Raises OutputError."""
    with replacing(path) as temporary:
        try:
            written = layer.Export(str(temporary))
        except Tf.ErrorException as error:
            raise OutputError(
                f"{path}: can't be written: {' '.join(str(error).split())}"
            ) from error
        if not written:
            raise OutputError(f"{path}: can't be written")


def set_attribute(
    prim: Usd.Prim, name: str, kind: Sdf.ValueTypeName, value: object, *, custom: bool = False
) -> None:
    """Create an attribute of a prim and set its value at the default time."""
    prim.CreateAttribute(name, kind, custom).Set(value)


def hash_shape(mesh: UsdGeom.Mesh) -> str:
    """Return a hash of a composed mesh's points and faces; empty if they are not numbers."""
    digest = hashlib.sha256()
    faces = mesh.GetFaceVertexCountsAttr(), mesh.GetFaceVertexIndicesAttr()
    for attribute, kind in ((mesh.GetPointsAttr(), "<f4"), *((one, "<i4") for one in faces)):
        value = attribute.Get()
        try:
            array = np.ascontiguousarray([] if value is None else value, kind)
        except (TypeError, ValueError):
            return ""
        digest.update(f"{array.size} ".encode() + array.tobytes())
    return digest.hexdigest()[:32]


def vec3f(points: ArrayLike) -> Vt.Vec3fArray:
    """Convert an array (n, 3) of any dtype to USD's array of float32 vectors."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, dtype=np.float32))


def vec3d(point: ArrayLike) -> Gf.Vec3d:
    """Convert three numbers (x, y, z) to USD's vector of float64."""
    x, y, z = (float(v) for v in np.asarray(point))
    return Gf.Vec3d(x, y, z)
