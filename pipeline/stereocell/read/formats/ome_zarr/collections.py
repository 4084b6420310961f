"""Describe OME-Zarr groups that hold images: plates, wells, containers of series, label images.

Such a group is not an image itself. One line describes its content, with the path that opens a part
of it. A container with a single image is opened.

References: OME-Zarr 0.5, https://ngff.openmicroscopy.org/0.5/ (plate, well, labels,
bioformats2raw.layout)
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import zarr

from stereocell.model.counted import counted
from stereocell.model.errors import SourceError
from stereocell.read.formats.ome_zarr.store import GuardedStore, open_store, zarr_boundary
from stereocell.storage.location import Location, is_own, require_own_key

CONTAINER = "bioformats2raw.layout"
_SHOWN = 8  # parts that a line lists; the others are only counted
_LOOKED_AT = 4  # label images whose type and number of objects are read
_MAX_SERIES = 1000  # images that are looked for in a container without a list of them
_NAME = 60  # characters of a path or name in a line
_GROUP_FILES = ("zarr.json", ".zgroup", ".zarray")


@dataclass(frozen=True, slots=True)
class ZarrTree:
    """The groups below an opened one. A group is read when it is needed."""

    location: Location
    store: GuardedStore
    zarr_format: Any

    def attributes(self, path: str) -> Mapping[str, Any]:
        """Return the OME attributes of a group; empty: the group is missing or can't be read."""
        return self.find(path) or {}

    def find(self, path: str) -> Mapping[str, Any] | None:
        """Return the OME attributes of a group; None: the group is missing or can't be read."""
        try:
            with zarr_boundary(self.location.shown, "a group"):
                group = zarr.open_group(
                    self.store, path=path, mode="r", zarr_format=self.zarr_format
                )
                return ome_of(group.metadata.attributes)
        except SourceError:
            return None

    def dtype(self, path: str) -> str:
        """Return the type of an array's numbers; empty: the array can't be read."""
        try:
            with zarr_boundary(self.location.shown, "an array"):
                array = zarr.open_array(
                    self.store, path=path, mode="r", zarr_format=self.zarr_format
                )
                return str(array.dtype.name)
        except SourceError:
            return ""


def ome_of(attributes: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the attributes of OME-Zarr, which are nested in `ome` since version 0.5."""
    ome = attributes.get("ome", attributes)
    return ome if isinstance(ome, Mapping) else {}


def series_of(ome: Mapping[str, Any], tree: ZarrTree) -> list[str]:
    """Return the paths of the images in a container; empty: the group is not a container.

    The group OME lists them; without a list they are numbered from 0.
    """
    if CONTAINER not in ome:
        return []
    listed = tree.attributes("OME").get("series")
    if isinstance(listed, list) and listed:
        return [path for path in map(str, listed) if path]
    found: list[str] = []
    while len(found) < _MAX_SERIES and "multiscales" in tree.attributes(str(len(found))):
        found.append(str(len(found)))
    return found


def part_of(location: Location, path: str) -> Location:
    """Return the location of a group below another. Raises SourceError where it lies elsewhere."""
    named = f"{location.shown}: {_cut(path)!r}"
    part = replace(location, source=f"{location.source.rstrip('/')}/{path}")
    if not location.is_local:
        require_own_key(path, named)
    elif not is_own(part.source, [location.folder]):
        raise SourceError(
            f"{named}: leads out of the group, expected a group inside it (links are followed)"
        )
    return part


def is_collection(ome: Mapping[str, Any]) -> bool:
    """Return whether a group's attributes say that it holds images, as a plate does."""
    return any(key in ome for key in ("plate", "well", CONTAINER, "labels"))


def image_of_level(location: Location) -> str:
    """Return the shown path of the OME-Zarr image that has an array as a level; empty: none."""
    source, _, name = location.source.rstrip("/").rpartition("/")
    image = replace(location, source=source)
    try:
        with zarr_boundary(image.shown, "a group"):
            group = zarr.open_group(GuardedStore(open_store(image), image), mode="r")
            multiscales = ome_of(group.metadata.attributes).get("multiscales")
    except SourceError:
        return ""
    tables = multiscales if isinstance(multiscales, list) else []
    is_level = any(name in _paths(table, "datasets") for table in tables)
    return image.shown if is_level else ""


def describe_group(
    ome: Mapping[str, Any], series: Sequence[str], tree: ZarrTree
) -> tuple[str, str]:
    """Return what a group without an image of its own holds, and how to open a part of it.

    The second text is empty if no part can be opened.
    """
    shown = tree.location.shown.rstrip("/")
    if "plate" in ome:
        wells = _paths(ome["plate"], "wells")
        if not wells:
            return "a plate without wells", ""
        fields = _paths(tree.attributes(wells[0]).get("well"), "images")
        return (
            f"a plate of {_counted(wells, 'well')}",
            "open an image of a well by its path, such as "
            f"{shown}/{_cut(wells[0])}/{_cut(fields[0]) if fields else '0'}",
        )
    if "well" in ome:
        fields = _paths(ome["well"], "images")
        if not fields:
            return "a well without images", ""
        return (
            f"a well of {_counted(fields, 'image')}",
            f"open one by its path, such as {shown}/{_cut(fields[0])}",
        )
    if CONTAINER in ome:
        if not series:
            return f"a container of series ({CONTAINER}) without an image", ""
        return (
            f"{_counted(series, 'image')} in one container ({CONTAINER})",
            f"open one by its path, such as {shown}/{_cut(series[0])}",
        )
    if "labels" in ome:
        names = [str(name) for name in ome["labels"]] if isinstance(ome["labels"], list) else []
        return f"a list of labels, {_counted(names, 'label image')}", ""
    groups = _groups_below(tree)
    if groups:
        return _counted(groups, "group"), f"open an image by its path: {shown}/PATH"
    return "no multiscales", ""


def notes_on_labels(tree: ZarrTree) -> tuple[str, ...]:
    """Return a sentence on the label images of an image, if it has any."""
    listed = tree.attributes("labels").get("labels")
    names = [str(name) for name in listed] if isinstance(listed, list) else []
    if not names:
        return ()
    described = [_label_image(tree, name) for name in names[:_LOOKED_AT]]
    described += [_cut(name) for name in names[_LOOKED_AT:_SHOWN]]
    if len(names) > _SHOWN:
        described.append(f"{len(names) - _SHOWN} more")
    return (f"its label images: {', '.join(described)} (--labels NAME builds the objects of one)",)


def labels_evidence(ome: Mapping[str, Any], location: Location) -> str:
    """Return the metadata that say that voxels number objects; empty: none do."""
    if "image-label" in ome:
        return "`image-label` in its attributes"
    parts = location.parts
    inside = any(part.endswith(".zarr") for part in parts[:-2])
    if len(parts) > 2 and parts[-2] == "labels" and (inside or _is_group(location)):
        return "its place among the `labels` of an image"
    return ""


def _label_image(tree: ZarrTree, name: str) -> str:
    ome = tree.attributes(f"labels/{name}")
    about = []
    multiscales = ome.get("multiscales")
    if isinstance(multiscales, list) and multiscales and isinstance(multiscales[0], Mapping):
        levels = _paths(multiscales[0], "datasets")
        about += [tree.dtype(f"labels/{name}/{levels[0]}")] if levels else []
    label = ome.get("image-label")
    objects = label.get("properties") if isinstance(label, Mapping) else None
    if isinstance(objects, list) and objects:
        about.append(f"properties of {counted(len(objects), 'object')}")
    known = ", ".join(filter(None, about))
    return _cut(name) + (f" ({known})" if known else "")


def _paths(table: Any, key: str) -> list[str]:
    """Return the `path` of each entry of a list in a table; empty: there is no such list."""
    entries = table.get(key) if isinstance(table, Mapping) else None
    if not isinstance(entries, list):
        return []
    return [str(e["path"]) for e in entries if isinstance(e, Mapping) and e.get("path")]


def _counted(names: Sequence[str], noun: str) -> str:
    listed = ", ".join(map(_cut, names[:_SHOWN]))
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return f"{len(names)} {noun}{'s' * (len(names) != 1)}" + (f" ({listed}{more})" * bool(names))


def _cut(name: str) -> str:
    """Return a name that can be printed: without control characters, and shortened."""
    clean = "".join(c if c.isprintable() else " " for c in name)
    return clean if len(clean) <= _NAME else f"{clean[:_NAME]}..."


def _groups_below(tree: ZarrTree) -> list[str]:
    """Return the sorted names of the groups in a folder; empty at an address."""
    if not tree.location.is_local or not Path(tree.location.source).is_dir():
        return []
    folder = Path(tree.location.source)
    names = sorted(path.name for path in folder.iterdir() if path.is_dir())
    return [name for name in names[:_MAX_SERIES] if tree.find(name) is not None]


def _is_group(location: Location) -> bool:
    """Return whether the folder that contains `labels` is a Zarr group of any name."""
    image = Path(location.source).parent.parent
    return location.is_local and any((image / file).is_file() for file in _GROUP_FILES)
