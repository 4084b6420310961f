"""Wording for objects whose simplification stopped early, used by the stage and the report."""

from collections.abc import Mapping

from stereocell.model.unit import ObjectFacts

_SHOWN = 8  # most tiles that a line names


def notes_on_stopped_levels(name: str, facts: Mapping[str, ObjectFacts]) -> list[str]:
    """Return a line for each level of detail whose simplification stopped early in some tile.

    name   name of the label map
    facts  measurements of the built objects, by tile ID
    """
    tiles: dict[int, list[str]] = {}
    for tile, one in facts.items():
        for level in one.stopped:
            tiles.setdefault(level, []).append(tile)
    return [
        f"{name}: simplifying lod{level} stopped early in "
        f"{', '.join(sorted(found)[:_SHOWN])}{', ...' * (len(found) > _SHOWN)}, because triangles "
        "would have crossed: it has more triangles than requested, or volumes of objects differ"
        for level, found in sorted(tiles.items())
    ]
