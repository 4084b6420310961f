"""Write an image of the surfaces, .png, or a turntable video, .mp4 and .webm.

They are drawn by the report's renderer, without OpenGL, so they are the same on every machine.
"""

import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from stereocell.export.chosen import Chosen
from stereocell.formats.gltf import vertex_colors
from stereocell.model.errors import OutputError
from stereocell.model.extra_packages import import_extra
from stereocell.report.draw_scenes import draw_image
from stereocell.textures.draw_meshes import Shape, turning_frame

PICTURE_TRIANGLES = 2_000_000  # largest number of triangles; more make no difference at 1600 pixels
VIDEO_TRIANGLES = 200_000  # a frame with 31 000 triangles and 640 pixels takes 0.35 s of CPU time
_PICTURE_WIDTH, _VIDEO_WIDTH = 1600, 640  # pixels
_FRAMES, _FPS = 120, 24  # one turn takes 5 s
_CODECS = {
    ".mp4": ["libx264", "-crf", "18", "-movflags", "+faststart"],
    ".webm": ["libvpx-vp9", "-crf", "28", "-b:v", "0"],
}
# These options give the same bytes each time: no threads, no time stamps, no version of ffmpeg.
_SAME_BYTES = ["-threads", "1", "-fflags", "+bitexact", "-flags:v", "+bitexact"]


def write_picture(chosen: Chosen, path: Path, level: int) -> str:
    """Write an image of the surfaces as .png; return a sentence about it."""
    width = chosen.options.width or _PICTURE_WIDTH
    shapes = list(_shapes(chosen, level))
    # Frame the surfaces and not the tiles: a patient's box is often twice as large.
    low = np.min([shape.positions.min(axis=0) for shape in shapes], axis=0)
    high = np.max([shape.positions.max(axis=0) for shape in shapes], axis=0)
    frame = tuple(low.tolist()), tuple(high.tolist())
    image = draw_image(shapes, frame, (width, width))
    image.save(path, optimize=True)
    return f"{image.width} x {image.height} pixels at lod{level}"


def write_turntable(chosen: Chosen, path: Path, level: int) -> str:
    """Write .mp4 or .webm; return a sentence about it. Raises UsageError without imageio-ffmpeg."""
    ffmpeg = import_extra("imageio_ffmpeg", extra="video", wanted_by=path.suffix)
    shapes = list(_shapes(chosen, level))
    size = _encode(chosen, path, shapes, ffmpeg.get_ffmpeg_exe())
    return f"{size[0]} x {size[1]} pixels, {_FRAMES} frames, {_FPS} a second, at lod{level}"


def _encode(chosen: Chosen, path: Path, shapes: list[Shape], ffmpeg: str) -> tuple[int, int]:
    """Draw the frames and pass each to ffmpeg; return their width and height."""
    width = chosen.options.width or _VIDEO_WIDTH
    frame = turning_frame(*chosen.box)
    first = draw_image(shapes, frame, (width, width))
    size = first.width // 2 * 2, first.height // 2 * 2  # yuv420p needs even sizes
    taken = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", f"{_FPS}"]
    made = ["-an", "-pix_fmt", "yuv420p", "-c:v", *_CODECS[path.suffix.lower()], *_SAME_BYTES]
    command = [ffmpeg, "-y", "-loglevel", "error", *taken, "-i", "-", *made, str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as encoder:
        assert encoder.stdin is not None
        assert encoder.stderr is not None
        try:
            for number in range(_FRAMES):
                turned = number * 360 / _FRAMES
                image = draw_image(shapes, frame, (width, width), turned_deg=turned)
                encoder.stdin.write(np.asarray(image)[: size[1], : size[0]].tobytes())
                if number % _FPS == 0:
                    chosen.report(f"frame {number}/{_FRAMES}")
            encoder.stdin.close()
        except BrokenPipeError:
            pass  # ffmpeg stopped, and its last line becomes the error below
        printed = encoder.stderr.read().decode(errors="replace").strip()
    if encoder.returncode:
        last = printed.splitlines()[-1] if printed else f"exit code {encoder.returncode}"
        raise OutputError(f"{path}: ffmpeg failed: {last}")
    return size


def _shapes(chosen: Chosen, level: int) -> Iterator[Shape]:
    count = 0
    for piece in chosen.pieces(level):
        count += 1
        color = np.array(piece.material.color)
        factors = vertex_colors(piece.mesh, occlusion=bool(chosen.options.occlusion))
        if factors is not None:
            color = factors / 255 * color
        mesh = piece.mesh
        yield Shape(mesh.positions, mesh.triangles, mesh.normals, color)
    if not count:
        raise chosen.nothing("surface")
