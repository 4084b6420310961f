"""Turn the stage's cameras into one stereo camera of Blender, with two off-axis eyes."""

from .choice import ROOT


def pair_cameras(scene, stage, objects, scale, is_stereo):
    """Make `mono` the scene's camera, with the eye distance of `left` and `right`.

    The clip distances of all cameras are scaled to Blender's units. Without `left`, `right` or a
    focus distance, the camera's stereo settings stay as they are.

    objects    Blender's objects by the path of their prim
    scale      Blender units in one unit of the stage
    is_stereo  whether both eyes are rendered
    """
    for block in objects.values():
        if block.type == "CAMERA":
            block.data.clip_start *= scale
            block.data.clip_end *= scale
    mono = objects.get(f"{ROOT}/Cameras/mono")
    prims = {name: stage.GetPrimAtPath(f"{ROOT}/Cameras/{name}") for name in ("left", "right")}
    if mono is None or mono.type != "CAMERA":
        return
    scene.camera = mono
    focus = stage.GetPrimAtPath(f"{ROOT}/Cameras/mono").GetAttribute("focusDistance").Get()
    shifts = [prim.GetAttribute("xformOp:translate").Get() for prim in prims.values() if prim]
    if focus is None or len(shifts) != 2 or None in shifts:
        return
    left, right = shifts
    stereo = mono.data.stereo
    stereo.convergence_mode = "OFFAXIS"
    stereo.interocular_distance = (right - left).GetLength() * scale
    stereo.convergence_distance = focus * scale
    scene.render.use_multiview = is_stereo
    scene.render.views_format = "STEREO_3D"
