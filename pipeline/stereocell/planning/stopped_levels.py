"""What stage and report say of levels of objects of which simplifying did not come to an end."""

from collections.abc import Mapping

from stereocell.model.unit import ObjectFacts

_SHOWN = 8  # tiles, by name


def told_of_stopped(name: str, facts: Mapping[str, ObjectFacts]) -> list[str]:
    """Return a line for each such level of a label map, or nothing; `facts` by tile."""
    tiles: dict[int, list[str]] = {}
    for tile, one in facts.items():
        for level in one.stopped:
            tiles.setdefault(level, []).append(tile)
    return [
        f"{name}: lod{level} has more triangles or other volumes than are asked for in "
        f"{', '.join(sorted(found)[:_SHOWN])}{', ...' * (len(found) > _SHOWN)}: triangles would "
        "have come to cross"
        for level, found in sorted(tiles.items())
    ]
