"""A bundle of two tiles, and how tests read one."""

import json
import tempfile
from contextlib import nullcontext
from pathlib import Path

from stereocell.engine.run import Engine
from stereocell.engine.run_steps import run_missing
from stereocell.steps import write_bundle as steps
from stereocell.usd.write_stage import TileExtent, write_stage, write_tile
from support import spheres
from support.glbs import read

TILES = (spheres.tile(0), spheres.tile(1))
CD31 = "/Specimen/Channels/CD31"


def write_tiles(folder, tiles=TILES):
    for tile in tiles:
        write_tile(folder, tile)
    write_stage(
        folder,
        "two tiles",
        appearances=(spheres.RED, spheres.BLUE),
        tiles=[TileExtent.of(t) for t in tiles],
        provenance={},
    )
    return folder / "stage.usda"


def load(path):
    return json.loads(path.read_text("utf-8"))


def channel(bundle, name="CD31"):
    (found,) = (c for c in load(bundle / "manifest.json")["channels"] if c["name"] == name)
    return found


def volumes(bundle):
    return load(bundle / channel(bundle)["volumes"]["path"])["volumes"]


def factor(bundle, tile="r0_c0"):
    document, _ = read((bundle / f"channels/CD31/{tile}/lod0.glb").read_bytes())
    return document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"]


def files(folder):
    return {p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def write_bundle(stage, folder, viewer, *, engine, parts=None, report_line=lambda _: None):
    """Write the bundle of a stage outside of a build, in the order of building/phases.py.

    parts  folder in which finished parts are kept and found again; None: a temporary folder
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    kept = nullcontext(parts) if parts else tempfile.TemporaryDirectory(dir=folder.parent)
    with kept as place, steps.opened_stage(stage) as composed:
        for note in composed.notes(stage):
            report_line(note)
        run_missing(engine, "bundle", steps.bundle_part_tasks(composed, Path(place)))
        for note in steps.write_bundle(composed, Path(place), folder, viewer):
            report_line(note)


def write(stage, folder):
    """Write the bundle of a stage; return the lines that were reported."""
    lines: list[str] = []
    write_bundle(stage, folder, None, engine=Engine(0), report_line=lines.append)
    return lines


def chain(bundle, tile):
    """Return the levels of detail of a tile in the tileset of CD31, coarsest first."""
    root = load(bundle / channel(bundle)["tileset"]["path"])["root"]
    found = []
    for entry in root["children"]:
        levels = []
        while True:
            folder, level = entry["content"]["uri"].split("/")
            levels.append(level)
            if "children" not in entry:
                break
            (entry,) = entry["children"]
        # 0 states that there is no finer level, so a reader stops.
        assert entry["geometricError"] == 0
        found += [levels] * (folder == tile)
    (levels,) = found
    return levels
