# ruff: noqa: E501  (tables of cases)
"""USD: layers over the stage that lie, form cycles, or lead out of its folder; exported and checked."""

import os
from collections.abc import Iterator
from pathlib import Path

from malformed.cases import Case, copied, cut, flip

KIND = "usd"
_HEAD = '#usda 1.0\n(\n defaultPrim = "Specimen"\n metersPerUnit = {unit}\n upAxis = "Y"\n subLayers = [{layers}]\n)\n'
_OVER = 'over "Specimen"\n{{\n over "Tiles"\n {{\n  over "r0_c0"\n  {{\n{tile}\n  }}\n }}\n over "Channels"\n {{\n  over "F"\n  {{\n{channel}\n  }}\n }}\n}}\n'
_MESH = '   over "F"\n   {{\n    over "F_r0_c0"\n    {{\n{}\n    }}\n   }}'
_VOLUME = '   over "F"\n   {{\n    over "F_r0_c0_volume"\n    {{\n{}\n    }}\n   }}'
_STAGE = "@out/stage/stage.usda@"


def layer(tile: str = "", channel: str = "", layers: str = _STAGE, unit: str = "1e-6") -> str:
    return _HEAD.format(unit=unit, layers=layers) + _OVER.format(tile=tile, channel=channel)


def cases() -> Iterator[Case]:
    escapes = {
        "parent": "@../../bait/secret.txt@", "absolute": "@/etc/hostname@", "backslash": "@..\\\\bait\\\\secret.txt@", "address": "@http://127.0.0.1:9/x.usda@",
        "nowhere": "@./nowhere.usdc@", "empty": "@@", "here": "@.@", "package": "@bait.usdz[x.usda]@", "long": "@" + "x/" * 3000 + "@", "odd": "@\u202ea\u00fc\U0001f9e0@",
        "expression": '@`"${HOME}"`@', "arguments": "@a.usda:SDF_FORMAT_ARGS:x=y@",
    }  # fmt: skip
    texts: dict[str, str] = {}
    for name, asset in escapes.items():
        texts[f"sublayer {name}"] = layer(layers=f"{_STAGE}, {asset}")
        texts[f"payload {name}"] = layer().replace(
            'over "r0_c0"', f'over "r0_c0" (payload = {asset})'
        )
        texts[f"reference {name}"] = layer().replace(
            'over "F"\n', f'over "F" (references = {asset})\n', 1
        )
        texts[f"atlas {name}"] = layer(_VOLUME.format(f"     asset stereocell:atlas = {asset}"))
    texts |= {
        "sublayer of itself": layer(layers=f"{_STAGE}, @edit.usda@"), "no layers": layer(layers=""), "empty": "", "no USD": "hello", "head alone": "#usda 1.0\n",
        "version 9": "#usda 9.0\n", "cut short": layer()[:200], "nul": "#usda 1.0\n\0\0", "nested": "#usda 1.0\n" + 'def "a" {' * 3000, "nested dictionaries": "#usda 1.0\n(customLayerData = {" + "dictionary a = {" * 3000,
        "metersPerUnit 0": layer(unit="0"), "metersPerUnit 1": layer(unit="1"), "metersPerUnit NaN": layer(unit="nan"), "metersPerUnit in words": layer(unit='"um"'),
        "tile inactive": layer().replace('over "r0_c0"', 'over "r0_c0" (active = false)'), "tile of another type": layer().replace('over "r0_c0"', 'def Sphere "r0_c0"'),
        "all tiles deactivated": layer().replace('over "Tiles"', 'over "Tiles" (active = false)'), "reference to its parent": layer().replace('over "r0_c0"', 'over "r0_c0" (references = </Specimen>)'),
        "reference to itself": layer().replace('over "r0_c0"', 'over "r0_c0" (references = </Specimen/Tiles/r0_c0>)'), "inherits in a ring": layer().replace('over "r0_c0"', 'over "r0_c0" (inherits = [</Specimen/Tiles/r0_c0>])'),
        "variant unknown": layer().replace('over "r0_c0"', 'over "r0_c0" (variants = { string lod = "lod99"\n string representation = "../x" })'),
        "moved by NaN": layer('   double3 xformOp:translate = (nan, 0, 0)\n   uniform token[] xformOpOrder = ["xformOp:translate"]'),
        "moved by inf": layer('   double3 xformOp:translate = (inf, 0, 0)\n   uniform token[] xformOpOrder = ["xformOp:translate"]'),
        "moved by 1e300": layer('   double3 xformOp:translate = (1e300, 0, 0)\n   uniform token[] xformOpOrder = ["xformOp:translate"]'),
        "scaled by 0": layer('   float3 xformOp:scale = (0, 0, 0)\n   uniform token[] xformOpOrder = ["xformOp:scale"]'),
        "order of ops unknown": layer('   uniform token[] xformOpOrder = ["xformOp:nothing"]'),
        "tile named odd": layer().replace('over "r0_c0"', 'def Xform "a" (displayName = "\u202e\\n")\n {}\n over "r0_c0"'),
        "channel's colour NaN": layer(channel="   color3f stereocell:color = (nan, 0, 0)"), "channel's colour in words": layer(channel='   string stereocell:color = "red"'),
        "channel's window turned": layer(channel="   float2 stereocell:window = (5, 1)"), "channel's window NaN": layer(channel="   float2 stereocell:window = (nan, nan)"),
        "hint empty": layer("   float3[] extentsHint = []"), "hint NaN": layer("   float3[] extentsHint = [(nan, 0, 0), (1, 1, 1)]"), "hint of one": layer("   float3[] extentsHint = [(0, 0, 0)]"),
    }  # fmt: skip
    for name, text in {
        "points NaN": "point3f[] points = [(nan, 0, 0), (1, 0, 0), (0, 1, 0)]", "points lost": "point3f[] points = []", "points blocked": "point3f[] points = None",
        "points inf": "point3f[] points = [(inf, 0, 0), (1, 0, 0), (0, 1, 0)]", "points in words": 'string points = "many"', "indices beyond": "int[] faceVertexIndices = [0, 1, 999999999]", "indices below 0": "int[] faceVertexIndices = [0, 1, -1]",
        "counts of 0": "int[] faceVertexCounts = [0, 0]", "counts below 0": "int[] faceVertexCounts = [-3]", "counts of 2^31": "int[] faceVertexCounts = [2147483647]", "normals too few": "normal3f[] normals = [(0, 0, 1)]", "normals NaN": "normal3f[] normals = [(nan, 0, 1)]",
        "distance NaN": "float stereocell:distance = nan", "distance in words": 'string stereocell:distance = "x"', "material lost": "rel material:binding = </nowhere>", "material of itself": "rel material:binding = </Specimen>", "orientation": 'uniform token orientation = "odd"',
    }.items():  # fmt: skip
        texts[f"mesh's {name}"] = layer(_MESH.format("     " + text))
    for name, text in {
        "size 0": "int3 stereocell:atlasSize = (0, 0, 0)", "size below 0": "int3 stereocell:atlasSize = (-1, 5, 5)", "size 2^31": "int3 stereocell:atlasSize = (2147483647, 2147483647, 2147483647)", "size of another": "int3 stereocell:atlasSize = (5, 5, 5)",
        "size in words": 'string stereocell:atlasSize = "x"', "apron 10^9": "int stereocell:apron = 1000000000", "apron below 0": "int stereocell:apron = -5", "bounds NaN": "double3 stereocell:boundsMin = (nan, 0, 0)", "bounds turned": "double3 stereocell:boundsMin = (1e9, 1e9, 1e9)", "bounds in words": 'string stereocell:boundsMin = "x"',
    }.items():  # fmt: skip
        texts[f"volume's {name}"] = layer(_VOLUME.format("     " + text))
    for name, text in texts.items():

        def make(base: Path, folder: Path, text: str = text) -> list[str]:
            copied(base, folder, "out")
            (folder / "edit.usda").write_text(text)
            return ["bundle", "out", "--workers", "0", "--stage", "edit.usda"]

        yield Case(name, KIND, make)
    yield from _files()


def _files() -> Iterator[Case]:
    for name in (
        "no USD",
        "link to itself",
        "folder",
        "pipe",
        "endless",
        "link out",
        "cut crate",
        "flipped crate 1",
        "flipped crate 2",
        "flipped crate 3",
    ):

        def make(base: Path, folder: Path, name: str = name) -> list[str]:
            out = copied(base, folder, "out")
            path = folder / "edit.usda"
            if "crate" in name:
                tile = next(out.glob("stage/tiles/r0_c0/*.usdc"))
                cut(tile, 0.7) if "cut" in name else flip(tile, int(name[-1]), 60)
                path.write_text(layer())
            elif name == "no USD":
                path = folder / "edit.usdc"
                path.write_bytes(b"PXR-USDC" + bytes(80) + b"\xff" * 200)
            elif name == "folder":
                path.mkdir()
            elif name == "pipe":
                os.mkfifo(path)
            else:
                os.symlink(
                    {
                        "link to itself": "edit.usda",
                        "endless": "/dev/zero",
                        "link out": "/etc/hostname",
                    }[name],
                    path,
                )
            return ["bundle", "out", "--workers", "0", "--stage", path.name]

        yield Case(f"layer: {name}", KIND, make)
