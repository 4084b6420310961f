"""Find by VTK which channel each pixel has to show, to compare the programs' pictures with it.

Only the stage's geometry counts here, at the level and with the tiles that the stage shows.
"""

import os
from dataclasses import dataclass

os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # no window, no X

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from pxr import Usd, UsdGeom, UsdShade

from support.dcc.view import View

HAIR = 2e-3  # share of the distance from the eye; channels this close together are equally near


@dataclass(frozen=True, slots=True)
class Truth:
    """The channel that each pixel of a view has to show.

    channels  linear colour by the channel's name; None where a mesh has colours of its own
    shown     (height, width): the channel's number; -1 where there is nothing, -2 where two
              channels are equally near
    alone     (height, width): whether the pixel has no other channel behind the first
    """

    channels: dict[str, tuple[float, float, float] | None]
    shown: NDArray[np.int64]
    alone: NDArray[np.bool_]

    @property
    def covered(self) -> NDArray[np.bool_]:
        return self.shown != -1


def find_truth(stage: Usd.Stage, view: View, size: tuple[int, int]) -> Truth:
    """Return what a stage with all its tiles loaded shows, in (width, height) pixels."""
    meshes: dict[str, list[pv.PolyData]] = {}
    colors: dict[str, tuple[float, float, float] | None] = {}
    cache = UsdGeom.XformCache()
    for prim in stage.Traverse():
        if not prim.IsA(UsdGeom.Mesh) or UsdGeom.Imageable(prim).ComputeVisibility() == "invisible":
            continue
        channel = prim.GetParent().GetName()
        mesh = UsdGeom.Mesh(prim)
        points = np.array(mesh.GetPointsAttr().Get(), np.float64)
        counts = np.array(mesh.GetFaceVertexCountsAttr().Get() or [], np.int64)
        if not len(counts):
            continue
        matrix = np.array(cache.GetLocalToWorldTransform(prim))
        points = points @ matrix[:3, :3] + matrix[3, :3]
        indices = np.array(mesh.GetFaceVertexIndicesAttr().Get(), np.int64).reshape(-1, 3)
        meshes.setdefault(channel, []).append(pv.PolyData.from_regular_faces(points, indices))
        colors[channel] = _color(prim)
    depths = np.stack([_depth(parts, view, size) for parts in meshes.values()])
    order = np.sort(depths, axis=0)
    shown = np.where(np.isfinite(order[0]), depths.argmin(axis=0), -1)
    if len(depths) > 1:
        with np.errstate(invalid="ignore"):
            is_fight = order[1] - order[0] < HAIR * order[0]
        shown[is_fight & (shown >= 0)] = -2
    return Truth(colors, shown, np.isfinite(depths).sum(axis=0) == 1)


def _color(prim: Usd.Prim) -> tuple[float, float, float] | None:
    """Return the plain colour of a mesh's shader; None where an image or its vertices feed it."""
    material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial()
    shader, _, _ = material.ComputeSurfaceSource()
    given = shader.GetInput("diffuseColor")
    if not given or given.HasConnectedSource():
        return None
    red, green, blue = given.Get()
    return red, green, blue


def _depth(parts: list[pv.PolyData], view: View, size: tuple[int, int]) -> NDArray[np.float64]:
    """Return the distance from the eye along -z of each pixel; infinite where nothing is."""
    plotter = pv.Plotter(off_screen=True, window_size=list(size))
    plotter.disable_anti_aliasing()
    for part in parts:
        plotter.add_mesh(part, color="white", lighting=False)
    eye = np.array(view.eye)
    plotter.camera.position = eye
    plotter.camera.focal_point = eye - [0, 0, 1]
    plotter.camera.up = (0, 1, 0)
    plotter.camera.view_angle = np.degrees(2 * np.arctan(view.slopes[1]))
    plotter.camera.clipping_range = (view.near, view.far)
    plotter.show(auto_close=False)
    depth = np.asarray(plotter.get_image_depth(), np.float64)  # negative, NaN where nothing is
    plotter.close()
    return np.where(np.isnan(depth), np.inf, -depth)
