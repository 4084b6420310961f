"""The view that all programs draw: the stage's camera `mono`, in the units of each file."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux

from stereocell.usd.layer import LIGHTS

CAMERA = "/Specimen/Cameras/mono"


@dataclass(frozen=True, slots=True)
class View:
    """A camera that looks along -z, with y up, in the units of a file.

    eye     (x, y, z)
    slopes  half of the picture's width and height at a distance of 1
    near, far  distances from the eye within which anything is drawn
    """

    eye: tuple[float, float, float]
    slopes: tuple[float, float]
    near: float
    far: float

    def json(self) -> dict[str, Any]:
        return asdict(self)


def view_of(stage: Usd.Stage) -> View:
    """Return the view of the stage's own camera, um."""
    camera = UsdGeom.Camera(stage.GetPrimAtPath(CAMERA)).GetCamera()
    eye = camera.transform.ExtractTranslation()
    window = camera.frustum.window
    reach = camera.clippingRange
    half = window.GetSize() / 2
    return View(tuple(eye), (half[0], half[1]), reach.min, reach.max)


def lights_of(stage: Usd.Stage) -> dict[str, Any]:
    """Return the stage's lights for a program that reads none.

    suns  distant lights: linear color, intensity, and the direction (x, y, z) towards the light
    dome  intensity of the dome light, whose image is in usd_assets
    """
    suns, dome = [], 0.0
    for prim in stage.GetPrimAtPath(LIGHTS).GetChildren():
        light = UsdLux.LightAPI(prim)
        intensity = light.GetIntensityAttr().Get()
        if prim.IsA(UsdLux.DomeLight):
            dome = intensity
            continue
        towards = UsdGeom.XformCache().GetLocalToWorldTransform(prim).GetRow3(2)
        color = tuple(light.GetColorAttr().Get())
        suns.append({"color": color, "intensity": intensity, "towards": tuple(towards)})
    return {"suns": suns, "dome": dome}


def fit(view: View, scale: float, shift: NDArray[np.float64]) -> View:
    """Convert a view in um to the units of a file, whose coordinates are `scale * (um - shift)`."""
    eye = (np.array(view.eye) - shift) * scale
    return View(tuple(eye.tolist()), view.slopes, view.near * scale, view.far * scale)


def write_camera(file: Path, layer: Path, view: View, unit: float) -> Path:
    """Write a layer over a USD file that adds the view as the camera /View; return the layer."""
    added = Sdf.Layer.CreateNew(str(layer))
    added.subLayerPaths = [str(file)]
    stage = Usd.Stage.Open(added)
    UsdGeom.SetStageMetersPerUnit(stage, unit)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    camera = UsdGeom.Camera.Define(stage, "/View")
    camera.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(*view.eye))
    camera.CreateFocalLengthAttr(1.0)
    camera.CreateHorizontalApertureAttr(2 * view.slopes[0])
    camera.CreateVerticalApertureAttr(2 * view.slopes[1])
    camera.CreateClippingRangeAttr(Gf.Vec2f(view.near, view.far))
    added.Save()
    return layer
