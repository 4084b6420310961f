"""The common part of every layer of a stage: units, root prim, export to disk.

USD never rescales between layers, so each layer states micrometres, Y up and its default prim.
Importing this module registers the codeless API schema of schemas/usd with USD, which reads its
schemas once, when the first stage of a process opens.
"""

import hashlib
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from pxr import Gf, Plug, Sdf, Tf, Usd, UsdGeom, UsdUtils, Vt

from stereocell.model.errors import OutputError
from stereocell.storage.assets import find_asset
from stereocell.storage.atomic_write import replacing

METERS_PER_UNIT = 1e-6  # a stage unit is 1 um
UP_AXIS = UsdGeom.Tokens.y
ROOT = Sdf.Path("/Specimen")
# A class that the root of each stage inherits: one edit for all specimens of a scene
BROADCAST = Sdf.Path("/__class__").AppendChild(ROOT.name)
# on /Specimen: the plane that it opens cut by, as its normal (x, y, z) and its offset, um, world
OPENING_CUT = "stereocell:openingCut"
# on /Specimen: lengths in display.usda for a length of the specimen, see usd/write_display.py
DISPLAY_SCALE = "stereocell:displayScale"
PAINTED_BY = "stereocell:paintedBy"  # on a channel's prim: ID of the channel that is painted on it
BUILT_COLOR = "stereocellBuiltColor"  # custom data of a surface's colour: the colour of the build
CHANNELS = ROOT.AppendChild("Channels")
# a prim for each channel, from which its surfaces and volumes in all tiles inherit the visibility
SHOWN = ROOT.AppendChild("Shown")
CLASSES = ROOT.AppendChild("Classes")  # by channel: materials of its objects' classes
TILES = ROOT.AppendChild("Tiles")
CAMERAS = ROOT.AppendChild("Cameras")
LIGHTS = ROOT.AppendChild("Lights")
CHANNEL_API = "StereoCellChannelAPI"
SPECIMEN_API = "StereoCellSpecimenAPI"
PATIENT_API = "StereoCellPatientAPI"
SURFACE_API = "StereoCellSurfaceAPI"
LAYER_SUFFIXES = (".usda", ".usdc", ".usd")

# where the patient's sides are, on the group of the tiles: directions (x, y, z) among its own axes
SIDES = {
    "left": "stereocell:left",
    "posterior": "stereocell:posterior",
    "superior": "stereocell:superior",
}

# attributes of a surface's mesh
SHAPE_HASH = "stereocell:shapeHash"
DISTANCE = "stereocell:distance"
LARGEST_DISTANCE = "stereocell:largestDistance"
DISTANCE_SAMPLES = "stereocell:distanceSamples"

Plug.Registry().RegisterPlugins(str(find_asset("schemas/usd")))


def new_stage(suffix: str, default_prim: str) -> Usd.Stage:
    """Return a stage in memory with one layer, its units and the name of its root prim.

    Payloads stay unloaded: their files need not exist yet.
    """
    layer = Sdf.Layer.CreateAnonymous(suffix)
    layer.defaultPrim = default_prim
    stage = Usd.Stage.Open(layer, Usd.Stage.LoadNone)
    UsdGeom.SetStageMetersPerUnit(stage, METERS_PER_UNIT)
    UsdGeom.SetStageUpAxis(stage, UP_AXIS)
    return stage


def is_layer(file: Path) -> bool:
    """Return whether USD can open a file as a layer; the file is read anew from the disk."""
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # USD prints pages about a damaged layer
    try:
        return Sdf.Layer.OpenAsAnonymous(str(file)) is not None
    except Tf.ErrorException:
        return False
    finally:
        del quiet


def export(layer: Sdf.Layer, path: Path) -> None:
    """Write a layer, whole or not at all. Raises OutputError where it can't be written."""
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
    """Return a hash of a composed mesh's points and faces; empty where they aren't numbers."""
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
    """Return (n, 3) numbers of any dtype as USD's array of float32."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, dtype=np.float32))


def vec3d(point: ArrayLike) -> Gf.Vec3d:
    """Return three numbers (x, y, z) as USD's vector of float64."""
    x, y, z = (float(v) for v in np.asarray(point))
    return Gf.Vec3d(x, y, z)
