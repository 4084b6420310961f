"""The media type with which a host serves each file of a bundle."""

from pathlib import PurePath

MEDIA_TYPES = {
    ".css": "text/css; charset=utf-8",
    ".glb": "model/gltf-binary",
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".ktx2": "image/ktx2",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".usdz": "model/vnd.usdz+zip",
    ".wasm": "application/wasm",
    ".webmanifest": "application/manifest+json",
}


def media_type(file: PurePath) -> str:
    """Return a file's media type from its ending."""
    return MEDIA_TYPES.get(file.suffix, "application/octet-stream")
