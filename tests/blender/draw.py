"""Render files in Blender after an import, by Blender's own importers or by the add-on.

This script runs in Blender's Python. Its argument is a JSON file with a list of jobs:
    file     path of the file to open
    by       "blender": Blender's own importer, into the default scene; or "add-on"
    view     the camera, in the numbers of the file; null: the file's own camera `mono`;
             "default": Blender's own camera, moved back until all meshes are in view
    choices  options of the add-on's import
    engine   renderer, "CYCLES" by default
    pixels   width and height of the image
    samples  samples per pixel, 16 by default
    picture  path of the PNG to write

The alpha of an image is the silhouette of the specimen. Jobs share the process, but each starts
with a fresh scene. The jobs don't run in forks as the steps of session.py do: in a fork, OpenEXR
waits for threads that no longer exist.
"""

import json
import math
import sys
from pathlib import Path

import bpy
import mathutils

LOCAL = Path(bpy.utils.resource_path("LOCAL"))
sys.path += [str(path) for path in LOCAL.glob("python/lib/python3*/site-packages")]
sys.path.append(str(Path(__file__).parents[2] / "usd_assets" / "blender"))

import stereocell_import  # noqa: E402


def open_plainly(job):
    """Open a file with Blender's own importer in the default scene, without the scene's cube."""
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    file = job["file"]
    if file.endswith((".glb", ".gltf")):
        assert bpy.ops.import_scene.gltf(filepath=file) == {"FINISHED"}
    else:
        assert bpy.ops.wm.usd_import(filepath=file) == {"FINISHED"}
    scene, view = bpy.context.scene, job["view"]
    if view == "default":
        frame_by_default_camera(scene)
        return
    scene.camera = bpy.data.objects["mono"] if view is None else add_camera(scene, view)


def add_camera(scene, view):
    """Add a camera that looks along the file's -z, which is Blender's +y; the file has y up."""
    block = bpy.data.objects.new("view", bpy.data.cameras.new("view"))
    scene.collection.objects.link(block)
    x, y, z = view["eye"]
    block.location = (x, -z, y)
    block.rotation_euler = (math.pi / 2, 0, 0)
    block.data.sensor_fit = "HORIZONTAL"
    block.data.lens = block.data.sensor_width / (2 * view["slopes"][0])
    block.data.clip_start, block.data.clip_end = view["near"], view["far"]
    return block


def frame_by_default_camera(scene):
    """Aim the default scene's camera at the meshes from its own direction, with all in view."""
    bpy.context.view_layer.update()
    boxes = [
        block.matrix_world @ mathutils.Vector(corner)
        for block in scene.objects
        if block.type == "MESH"
        for corner in block.bound_box
    ]
    low, high = (mathutils.Vector(map(end, zip(*boxes, strict=True))) for end in (min, max))
    camera = scene.camera
    away = (high - low).length / 2 / math.sin(camera.data.angle_y / 2)
    backwards = camera.matrix_world.to_3x3() @ mathutils.Vector((0, 0, 1))
    camera.location = (low + high) / 2 + away * backwards
    camera.data.clip_start, camera.data.clip_end = away / 100, away * 10


def import_by_the_addon(job):
    """Import a stage into the default scene with the add-on's operator, as its menu does."""
    stereocell_import.register()
    done = bpy.ops.import_scene.stereocell(filepath=job["file"], **job.get("choices", {}))
    stereocell_import.unregister()
    assert done == {"FINISHED"}


def render(job):
    """Render the scene to a PNG with few samples.

    EEVEE needs OpenGL 4.3 without a window. With Mesa's software renderer, the first image of a
    process takes minutes, because its shaders are compiled.
    """
    scene = bpy.context.scene
    scene.render.engine = job.get("engine", "CYCLES")
    scene.render.use_multiview = False
    scene.cycles.device = "CPU"
    scene.cycles.samples = job.get("samples", 16)
    scene.cycles.use_denoising = False
    scene.eevee.taa_render_samples = job.get("samples", 16)
    scene.render.film_transparent = True
    scene.render.resolution_x, scene.render.resolution_y = job["pixels"]
    scene.render.resolution_percentage = 100
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.filepath = job["picture"]
    bpy.ops.render.render(write_still=True)


def main():
    for job in json.loads(Path(sys.argv[1]).read_text("utf-8")):
        bpy.ops.wm.read_factory_settings()
        {"blender": open_plainly, "add-on": import_by_the_addon}[job["by"]](job)
        render(job)


main()
