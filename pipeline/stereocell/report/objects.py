"""The report's numbers of label maps: objects, and how exact their surfaces are."""

from dataclasses import dataclass
from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.planning.plan import Plan
from stereocell.planning.stopped_levels import notes_on_stopped_levels
from stereocell.steps.unit_files import load_objects, load_record


@dataclass(frozen=True, slots=True)
class ObjectLevel:
    """One level of detail of all objects of a label map.

    distance_um, farthest_um  distance from the faces between voxels, um: 99th percentile, largest
    bias   largest relative error of an object's volume, compared with its voxels
    bytes  size of this level's .glb files in the bundle
    """

    triangles: int
    distance_um: float
    farthest_um: float
    bias: float
    bytes: int


@dataclass(frozen=True, slots=True)
class LabelFacts:
    """The numbers of one label map.

    color    linear RGB, 0..1
    objects  number of objects
    pieces   number of further pieces, into which the planes between tiles cut objects
    changed  voxels that were changed, so that no object touches itself at an edge or a corner
    stopped  notes on objects whose simplification stopped early
    units    folders of the label map's units that have a surface
    """

    name: str
    color: tuple[float, float, float]
    objects: int
    pieces: int
    changed: int
    stopped: tuple[str, ...]
    levels: tuple[ObjectLevel, ...]
    units: tuple[Path, ...]


def gather_labels(out_folder: OutFolder, plan: Plan) -> tuple[LabelFacts, ...]:
    """Return the numbers of each label map. Raises OutputError where a unit is damaged."""
    index = out_folder.index()
    found = []
    for labels in plan.labels:
        folders = {
            tile.id: out_folder.unit_dir(name, index[name])
            for tile in plan.tiles
            for name in [f"{tile.id}/{labels.id}"]
        }
        facts = {tile: load_objects(folder) for tile, folder in folders.items()}
        records = {tile: load_record(folder)["lods"] for tile, folder in folders.items()}
        numbers = [label for one in facts.values() for label in one.labels.tolist()]
        levels = []
        for level in range(max((len(one) for one in records.values()), default=0)):
            lods = {tile: one[level] for tile, one in records.items() if level < len(one)}
            files = [
                out_folder.bundle_dir / "channels" / labels.id / tile / f"lod{level}.glb"
                for tile in lods
            ]
            levels.append(
                ObjectLevel(
                    sum(lod["triangles"] for lod in lods.values()),
                    max(lod["distance_um"] for lod in lods.values()),
                    max(lod["farthest_um"] for lod in lods.values()),
                    max(facts[tile].bias[level] for tile in lods),
                    sum(map(out_folder.size, files)),
                )
            )
        found.append(
            LabelFacts(
                labels.name,
                labels.color,
                len(set(numbers)),
                len(numbers) - len(set(numbers)),
                sum(one.changed for one in facts.values()),
                tuple(notes_on_stopped_levels(labels.name, facts)),
                tuple(levels),
                tuple(folders[tile] for tile, one in records.items() if one),
            )
        )
    return tuple(found)
