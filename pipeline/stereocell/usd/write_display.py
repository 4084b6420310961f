"""Write display.usda: the stage enlarged to the size of everyday objects.

A specimen of 67 um in true size is nearer than the near clipping plane of most cameras.
display.usda is in metres. It references stage.usda and enlarges it by a transform, so stage.usda
itself stays in true size.

Scenes reference display.usda, so its root prim has the specimen's name. Edits belong to /Specimen
of stage.usda, which has the same name for all specimens. So a layer with edits also fits the next
build or another specimen. The file has its own cameras, since a transform moves a camera but does
not scale its clipping range.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Kind, Sdf, Tf, Usd, UsdGeom

from stereocell.model.physical_size import describe_size
from stereocell.usd.cameras import define_cameras
from stereocell.usd.layer import CAMERAS, METERS_PER_UNIT, ROOT, UP_AXIS, export, vec3f
from stereocell.usd.written_files import DISPLAY_NAME, STAGE_NAME


def write_display(
    stage_dir: Path,
    name: str,
    version: str,
    box: NDArray[np.float64],
    shown: NDArray[np.float64],
    scale: float,
) -> None:
    """Write display.usda beside stage.usda.

    name     display name of the specimen; the root prim's name is made from it
    version  version of the asset, the same as in stage.usda
    box      (2, 3), lower and upper corner (x, y, z) of the specimen, world um
    shown    (2, 3), lower and upper corner of the visible content, which the cameras frame
    scale    factor by which the specimen is enlarged

    Raises OutputError if the file can't be written.
    """
    layer = Sdf.Layer.CreateAnonymous(".usda")
    display = Sdf.Path.absoluteRootPath.AppendChild(Tf.MakeValidIdentifier(name))
    layer.defaultPrim = display.name
    size = describe_size(box[1] - box[0])
    layer.documentation = (
        f"The stage in metres, enlarged {scale:g} times. The size of the specimen is {size}. "
        "To edit the specimen, put a layer over stage.usda."
    )
    factor = scale * METERS_PER_UNIT
    stage = Usd.Stage.Open(layer, Usd.Stage.LoadNone)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdGeom.SetStageUpAxis(stage, UP_AXIS)
    root = UsdGeom.Xform.Define(stage, display).GetPrim()
    root.SetDisplayName(name)
    root.SetDocumentation(f"{name}: {size} in true size; {scale:g} times as large here, in metres.")
    model = Usd.ModelAPI(root)
    model.SetKind(Kind.Tokens.assembly)
    model.SetAssetName(name)
    model.SetAssetVersion(version)
    model.SetAssetIdentifier(Sdf.AssetPath(f"./{DISPLAY_NAME}"))
    UsdGeom.ModelAPI.Apply(root).SetExtentsHint(vec3f(box * factor))
    specimen = UsdGeom.Xform.Define(stage, display.AppendChild(ROOT.name))
    specimen.AddScaleOp(UsdGeom.XformOp.PrecisionDouble, "display").Set(Gf.Vec3d(factor))
    hidden = Sdf.CreatePrimInLayer(layer, specimen.GetPath().AppendChild(CAMERAS.name))
    hidden.active = False
    group = display.AppendChild(CAMERAS.name)
    define_cameras(stage, box * factor, shown * factor, group=group, unit_m=1.0)
    del stage  # the reference would not resolve for a layer in memory
    reference = layer.GetPrimAtPath(specimen.GetPath()).referenceList
    reference.prependedItems.append(Sdf.Reference(f"./{STAGE_NAME}"))
    export(layer, stage_dir / DISPLAY_NAME)
