"""Frame a specimen with three cameras: `mono`, and `left` and `right` for a stereo pair.

They frame the visible content and not the whole box. For example, the surfaces of a head can fill a
small part of a scan's box if the scanner's gantry was tilted. The viewer does the same.

The viewer scales the specimen to a longest edge of 1.2 m. The cameras use the same scale, so the
distance between the eyes, 63 mm, is divided by it. Both eyes look straight ahead, in parallel.
Their image windows are shifted so that both see the specimen's centre at the same place (off-axis
stereo, no keystone distortion).

USD states lens numbers in tenths of a stage unit: millimetres become mm * 0.01 / metersPerUnit.

References: OpenUSD, UsdGeomCamera (units of camera lens attributes).
"""

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd, UsdGeom

from stereocell.usd.layer import CAMERAS, METERS_PER_UNIT, vec3d

ROOM_SIZE_M = 1.2  # m, the specimen's longest edge in the viewer's room
PUPIL_DISTANCE_M = 0.063
FOCAL_LENGTH_MM = 35.0
APERTURE_MM = (36.0, 20.25)  # (width, height), 16:9
MARGIN = 1.08  # camera distance, as a multiple of that at which the specimen fills the frame


def define_cameras(
    stage: Usd.Stage,
    box: NDArray[np.float64],
    shown: NDArray[np.float64],
    *,
    group: Sdf.Path = CAMERAS,
    unit_m: float = METERS_PER_UNIT,
) -> None:
    """Define the three cameras of a stage, which look along -z.

    box     (2, 3), lower and upper corner (x, y, z) of all content, in the world; the cameras
            stand in front of it
    shown   (2, 3), corners of the box around the visible content, which the cameras frame
    group   path of the cameras' parent prim
    unit_m  length of a stage unit, in metres
    """
    lens = 0.01 / unit_m  # mm -> tenths of a stage unit
    width, height, depth = (float(v) for v in shown[1] - shown[0])
    eye = 0.5 * PUPIL_DISTANCE_M * float((box[1] - box[0]).max()) / ROOM_SIZE_M
    across, upwards = (0.5 * a / FOCAL_LENGTH_MM for a in APERTURE_MM)
    # The front face is nearest and decides the distance. `eye`, half the distance between the eyes,
    # widens it so that both eyes see it whole.
    to_front = MARGIN * max((width / 2 + eye) / across, height / 2 / upwards)
    centre = shown.mean(axis=0)
    distance = max(to_front + depth / 2, MARGIN * float(box[1, 2] - centre[2]))
    UsdGeom.Scope.Define(stage, group)
    roles = {
        "mono": (0.0, UsdGeom.Tokens.mono),
        "left": (-eye, UsdGeom.Tokens.left),
        "right": (eye, UsdGeom.Tokens.right),
    }
    for name, (shift, role) in roles.items():
        camera = UsdGeom.Camera.Define(stage, group.AppendChild(name))
        camera.AddTranslateOp().Set(vec3d(centre + np.array([shift, 0, distance])))
        camera.CreateFocalLengthAttr(FOCAL_LENGTH_MM * lens)
        camera.CreateHorizontalApertureAttr(APERTURE_MM[0] * lens)
        camera.CreateVerticalApertureAttr(APERTURE_MM[1] * lens)
        if shift:
            camera.CreateHorizontalApertureOffsetAttr(-shift * FOCAL_LENGTH_MM * lens / distance)
        camera.CreateFocusDistanceAttr(distance)
        camera.CreateClippingRangeAttr(Gf.Vec2f(distance / 100, distance * 10))
        camera.CreateStereoRoleAttr(role)
