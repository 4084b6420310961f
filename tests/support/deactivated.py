"""Layers over the stage of support/stages.py that deactivate one of its prims, such as a tile."""

from pathlib import Path

from support.stages import BALL_ID, F_ID, HEAD, leaf

PARTS = {
    "a tile": "/Specimen/Tiles/r0_c0",
    "a channel": f"/Specimen/Channels/{F_ID}",
    "a channel in a tile": f"/Specimen/Tiles/r0_c0/{F_ID}",
    "a mesh": leaf("r0_c0", F_ID),
    "a level of detail": leaf("r0_c0", F_ID),
    "a volume": leaf("r0_c0", BALL_ID, "_volume"),
    "the cameras": "/Specimen/Cameras",
    "the lights": "/Specimen/Lights",
}


def deactivate(part: str, layer: Path, stage: Path) -> Path:
    """Write a layer that deactivates one of PARTS; the level of detail is the finest, `lod0`."""
    *above, name = PARTS[part].strip("/").split("/")
    body = f'over "{name}" (\n    active = false\n)\n{{\n}}'
    for parent in reversed(above):
        inside, metadata = body, ""
        if part == "a level of detail" and parent == "r0_c0":
            metadata = '(\n    prepend variantSets = "lod"\n)'
            inside = f'variantSet "lod" = {{\n"lod0" {{\n{body}\n}}\n}}'
        body = f'over "{parent}" {metadata}\n{{\n{inside}\n}}'
    layer.write_text(f"{HEAD}subLayers = [@{stage}@])\n{body}\n")
    return layer
