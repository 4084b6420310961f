"""The process that draws meshes: `python report/draw_meshes_process.py FOLDER`.

It reads FOLDER/scenes.json and writes FOLDER/0.png, 1.png, ... On a machine without OpenGL it
writes the reason into FOLDER/refused.txt, unless VTK ends the process first.
"""

import json
import resource
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Direction of the eye, from the front, above and the right: x right, y up, z towards the viewer.
_EYE = np.array([0.42, 0.5, 1.0])
_UP = np.array([0.0, 1.0, 0.0])
_GROUND = (11, 13, 16)
_FINE = 2  # factor by which a picture is drawn larger, then averaged down
_MARGIN = 1.04  # factor by which the view exceeds the frame


def main(folder: Path) -> None:
    """Draw the scenes of `folder`; write the reason where VTK can't."""
    try:
        import pyvista
    except ImportError as error:  # a system library that VTK links to is missing
        (folder / "refused.txt").write_text(f"VTK can't be loaded ({error.msg})")
        return
    for i, scene in enumerate(json.loads((folder / "scenes.json").read_text())):
        image = _draw(pyvista, scene)
        if scene["surfaces"] and (image == image[0, 0]).all():
            (folder / "refused.txt").write_text("OpenGL drew nothing")
            return
        from PIL import Image

        picture = Image.fromarray(image)
        picture.reduce(_FINE).save(folder / f"{i}.png", compress_level=1)


def _draw(pyvista: Any, scene: dict[str, Any]) -> NDArray[np.uint8]:
    """Return the scene as uint8 (rows, columns, 3), parallel projection, `frame` filling it."""
    low, high = (np.array(corner) for corner in scene["frame"])
    to_eye = _EYE / np.linalg.norm(_EYE)
    right = np.cross(_UP, to_eye)
    right /= np.linalg.norm(right)
    up = np.cross(to_eye, right)
    # width and height of the frame's box from the eye
    size = high - low
    across, upright = float(np.abs(right) @ size), float(np.abs(up) @ size)
    width, most = scene["size"]
    height = int(np.clip(width * upright / across, min(0.3 * width, most), most))

    plotter = pyvista.Plotter(off_screen=True, window_size=(width * _FINE, height * _FINE))
    plotter.background_color = _GROUND
    for surface in scene["surfaces"]:
        with np.load(surface["file"]) as arrays:
            mesh = pyvista.PolyData.from_regular_faces(
                arrays["positions"], arrays["triangles"].astype(np.int64)
            )
            mesh.point_data.active_normals = arrays["normals"]
        plotter.add_mesh(mesh, color=surface["color"], smooth_shading=True, specular=0.25,
                         specular_power=20, ambient=0.12)  # fmt: skip
    for a, b in scene["boxes"]:
        (x0, y0, z0), (x1, y1, z1) = a, b
        box = pyvista.Box((x0, x1, y0, y1, z0, z1))
        plotter.add_mesh(box, style="wireframe", color=(0.42, 0.45, 0.5), lighting=False)
    centre, distance = (low + high) / 2, 2 * float(np.linalg.norm(size))
    plotter.camera.focal_point = centre
    plotter.camera.position = centre + to_eye * distance
    plotter.camera.up = _UP
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = _MARGIN / 2 * max(upright, across * height / width)
    plotter.camera.clipping_range = (0.5 * distance, 1.5 * distance)
    image = plotter.screenshot(None, return_img=True)
    plotter.close()
    return np.ascontiguousarray(image[:, :, :3])


if __name__ == "__main__":
    # without OpenGL, VTK ends by a segmentation fault: expected, so no core file is written
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    main(Path(sys.argv[1]))
