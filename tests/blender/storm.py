"""Draw a stage with Storm, the renderer that ships with USD, lit by the stage's own lights.

This script runs in Blender's Python, whose package `bpy` has USD with Storm. OpenGL comes from EGL,
without a window. The arguments are the stage, the path of a camera, the PNG to write, and its width
in pixels.
"""

import ctypes
import os
import sys

os.environ.setdefault("EGL_PLATFORM", "surfaceless")  # Mesa draws without a GPU

# Constants from EGL/egl.h and from the extension EGL_KHR_create_context
_SURFACE_TYPE, _PBUFFER, _RENDERABLE, _NONE = 0x3033, 0x0001, 0x3040, 0x3038
_OPENGL_BIT, _OPENGL_API, _DEPTH_BITS, _ALPHA_BITS = 0x0008, 0x30A2, 0x3025, 0x3021
_MAJOR, _MINOR, _PROFILE, _COMPATIBILITY = 0x3098, 0x30FB, 0x30FD, 0x0002
_WIDTH, _HEIGHT = 0x3057, 0x3056


def make_context() -> None:
    """Create an OpenGL 4.5 context and make it current. Raises RuntimeError if EGL has none."""
    egl = ctypes.CDLL("libEGL.so.1")
    for name in ("eglGetDisplay", "eglCreateContext", "eglCreatePbufferSurface"):
        getattr(egl, name).restype = ctypes.c_void_p
    display = ctypes.c_void_p(egl.eglGetDisplay(None))
    if not egl.eglInitialize(display, None, None):
        raise RuntimeError("EGL has no display")
    egl.eglBindAPI(_OPENGL_API)
    config, count = ctypes.c_void_p(), ctypes.c_int()
    wanted = (_SURFACE_TYPE, _PBUFFER, _RENDERABLE, _OPENGL_BIT, _ALPHA_BITS, 8, _DEPTH_BITS, 24)
    egl.eglChooseConfig(display, _list(*wanted), ctypes.byref(config), 1, ctypes.byref(count))
    profile = _list(_MAJOR, 4, _MINOR, 5, _PROFILE, _COMPATIBILITY)
    context = ctypes.c_void_p(egl.eglCreateContext(display, config, None, profile))
    size = _list(_WIDTH, 64, _HEIGHT, 64)
    surface = ctypes.c_void_p(egl.eglCreatePbufferSurface(display, config, size))
    if not egl.eglMakeCurrent(display, surface, surface, context):
        raise RuntimeError("EGL has no context of OpenGL 4.5")


def _list(*attributes: int) -> ctypes.Array:
    return (ctypes.c_int * (len(attributes) + 1))(*attributes, _NONE)


def draw(stage_path: str, camera: str, picture: str, width: int) -> None:
    """Draw a stage from one of its cameras, lit only by the stage's own lights."""
    import bpy

    bpy.utils.expose_bundled_modules()
    from pxr import Usd, UsdAppUtils, UsdGeom

    stage = Usd.Stage.Open(stage_path)
    recorder = UsdAppUtils.FrameRecorder("HdStormRendererPlugin", True, True)
    recorder.SetImageWidth(width)
    recorder.SetColorCorrectionMode("sRGB")
    recorder.SetCameraLightEnabled(False)
    seen = UsdGeom.Camera(stage.GetPrimAtPath(camera))
    if not recorder.Record(stage, seen, Usd.TimeCode.Default(), picture):
        raise RuntimeError(f"{picture}: Storm has drawn nothing")


if __name__ == "__main__":
    make_context()
    draw(*sys.argv[1:4], int(sys.argv[4]))
    sys.stdout.flush()
    os._exit(0)  # USD's threads would crash when the interpreter ends
