"""Read the metadata of an OME-Zarr image, versions 0.1 to 0.6: axes, levels and their places.

- 0.1 and 0.2 name no axes: they are t, c, z, y, x. They state no spacing.
- 0.3 lists the names of axes, without types and units. It states no spacing.
- 0.4 and 0.5 have axes with units; a level's transformations apply before those of the image.
- 0.6 (RFC-5) names coordinate systems. A level's transformation leads to the image's own system,
  and the image's transformations lead from there to others.

Only transformations that keep the grid's axes are read: scale, translation, identity, sequences of
them, and affine matrices without rotation and shear.

References: https://ngff.openmicroscopy.org, RFC-4 (orientation), RFC-5 (coordinate systems)
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stereocell.model.errors import SourceError
from stereocell.read.spacing import um_per
from stereocell.read.statements import omission

Placement = tuple[list[float] | None, list[float] | None]  # scale and translation of a level

_FIXED = ("t", "c", "z", "y", "x")  # axes of versions 0.1 and 0.2
_WITHOUT_AXES = ("0.1", "0.2", "")
_WITHOUT_SPACING = ("0.1", "0.2", "0.3")
KNOWN = ("0.1", "0.2", "0.3", "0.4", "0.5", "0.6")
_DEEPEST = 20  # sequences nested within each other; deeper ones are refused


def version_of(ome: Mapping[str, Any]) -> str:
    """Return the version that a group's attributes state; empty: none.

    >>> version_of({"version": "0.5", "multiscales": [{}]}), version_of({})
    ('0.5', '')
    """
    listed = ome.get("multiscales")
    first = listed[0] if isinstance(listed, list) and listed else {}
    own = first.get("version") if isinstance(first, Mapping) else None
    return str(own or ome.get("version") or "")


def is_known(version: str) -> bool:
    """Return whether a version is known, including its drafts such as `0.6.dev1`."""
    return not version or any(re.match(rf"{re.escape(one)}(?![0-9])", version) for one in KNOWN)


class NotAlongAxesError(ValueError):
    """A transformation rotates or shears the grid, or has an unknown kind; the text names it."""


@dataclass(frozen=True, slots=True)
class Multiscale:
    """The metadata of one image.

    version       stated version; empty: not stated
    names         names of the axes, in lower case
    units         units of the axes, um; None: not a unit of length
    orientations  orientations of the axes, such as `left-to-right`; empty: not stated
    paths         paths of the levels, finest first
    placements    scale and translation of each level, in the axes' units; None: not stated
    notes         sentences for the user
    """

    version: str
    names: tuple[str, ...]
    units: tuple[float | None, ...]
    orientations: tuple[str, ...]
    paths: tuple[str, ...]
    placements: tuple[Placement, ...]
    notes: tuple[str, ...] = ()

    @property
    def names_axes(self) -> bool:
        """Whether the metadata name the axes. Versions 0.1 and 0.2 don't."""
        return self.names != _FIXED or self.version not in _WITHOUT_AXES

    @property
    def places_voxels(self) -> bool:
        """Whether the version has transformations, which state the spacing."""
        return self.version not in _WITHOUT_SPACING

    @property
    def title(self) -> str:
        """The format with its version, for messages."""
        return f"OME-Zarr {self.version}".rstrip()


def parse(where: str, ome: Mapping[str, Any]) -> Multiscale:
    """Return the metadata of the first image in a group's attributes.

    Raises SourceError where transformations rotate the grid, and ValueError, KeyError or TypeError
    where the metadata don't follow any version.
    """
    multiscale = ome["multiscales"][0]
    version = version_of(ome)
    datasets = list(multiscale["datasets"])
    paths = tuple(str(dataset["path"]) for dataset in datasets)
    axes, notes, system = _axes(multiscale, version)
    names = tuple(str(axis["name"]).lower() for axis in axes)
    if len(set(names)) != len(names):
        raise ValueError(f"axes {', '.join(names)}: two have the same name")
    try:
        placements = tuple(_placement(multiscale, one, len(names), system) for one in datasets)
    except NotAlongAxesError as error:
        letters = "".join(names) if all(len(name) == 1 for name in names) else "zyx"
        raise SourceError(
            f"{where}: OME-Zarr {version}: coordinateTransformations: found {error}, expected "
            f"scales and translations; {where.rstrip('/')}/{paths[0] if paths else 0} --axes "
            f"{letters} --spacing-um z,y,x reads the voxels as stored"
        ) from None
    return Multiscale(
        version,
        names,
        tuple(um_per(axis.get("unit")) for axis in axes),
        tuple(_orientation(axis) for axis in axes),
        paths,
        placements,
        (*_newer(version), *notes, *_repeated(multiscale, placements, system)),
    )


def _newer(version: str) -> tuple[str, ...]:
    if is_known(version):
        return ()
    return (
        f"OME-Zarr {version:.20}: this version is unknown and is read like {KNOWN[-1]}: compare "
        "axes and spacing with the program that wrote them",
    )


def _axes(
    multiscale: Mapping[str, Any], version: str
) -> tuple[Sequence[Mapping[str, Any]], tuple[str, ...], str | None]:
    """Return the axes, notes on them, and the name of the coordinate system that has them.

    The name is None before version 0.6.
    """
    if "coordinateSystems" in multiscale and "axes" not in multiscale:
        return _axes_of_system(multiscale)
    if "axes" not in multiscale and version in _WITHOUT_AXES:
        note = (
            f"OME-Zarr {version or 'without a version'} names no axes: they are read as "
            f"{', '.join(_FIXED)}, by its specification"
        )
        return [{"name": name} for name in _FIXED], (note,), None
    axes = multiscale["axes"]
    if all(isinstance(axis, str) for axis in axes):
        return [{"name": axis} for axis in axes], (), None
    if not all(isinstance(axis, Mapping) for axis in axes):
        raise ValueError("axes don't have the form of OME-Zarr 0.3 to 0.6")
    return axes, (), None


def _axes_of_system(
    multiscale: Mapping[str, Any],
) -> tuple[Sequence[Mapping[str, Any]], tuple[str, ...], str]:
    """Return the axes of the coordinate system that is read, notes, and the system's name.

    It is the system to which the levels lead. If that has no units of length, it is another one
    that has units and to which a transformation of the image leads from the first.
    """
    systems = {str(one["name"]): one["axes"] for one in multiscale["coordinateSystems"]}
    own = multiscale["datasets"][0].get("coordinateTransformations") or [{}]
    first = _system_of(own[0], "output") or next(iter(systems))
    if first not in systems:
        raise ValueError(f"coordinateSystems: {first!r:.60} is not among them")
    further = [
        _system_of(step, "output")
        for step in multiscale.get("coordinateTransformations", [])
        if _system_of(step, "input") == first
    ]
    reached = [first, *(name for name in further if name in systems)]
    name = next((one for one in reached if _has_lengths(systems[one])), first)
    reason = f"the levels lead to {name}"
    reason += ", the image's own" if name == first else f" by {first}, which has no units"
    others = [other for other in systems if other not in (first, name)]
    note = omission(f"coordinate systems {', '.join(others)}", reason)
    return systems[name], (note,) if others else (), name


def _has_lengths(axes: Sequence[Mapping[str, Any]]) -> bool:
    """Return whether z, y and x have a unit of length."""
    measured = {str(axis["name"]).lower() for axis in axes if um_per(axis.get("unit")) is not None}
    return set("zyx") <= measured


def _way_to(
    steps: Sequence[Mapping[str, Any]], system: str, multiscale: Mapping[str, Any]
) -> list[Mapping[str, Any]]:
    """Return the transformations from a level to a coordinate system."""
    direct = [one for one in steps if _system_of(one, "output") == system]
    if direct:
        return direct[:1]
    first = _system_of(steps[0], "output")
    onwards = [
        one
        for one in multiscale.get("coordinateTransformations", [])
        if (_system_of(one, "input"), _system_of(one, "output")) == (first, system)
    ]
    return [steps[0], *onwards[:1]]


def _system_of(step: Mapping[str, Any], end: str) -> str:
    """Return the coordinate system at an end of a transformation; drafts differ in its form."""
    found = step.get(end, "")
    return str(found.get("name", "") if isinstance(found, Mapping) else found)


def _orientation(axis: Mapping[str, Any]) -> str:
    stated = axis.get("orientation")
    if not isinstance(stated, Mapping) or stated.get("type") != "anatomical":
        return ""
    return str(stated.get("value", "")).strip().lower()


def _placement(
    multiscale: Mapping[str, Any], dataset: Mapping[str, Any], dimensions: int, system: str | None
) -> Placement:
    """Return scale and translation of a level.

    The level's own transformations apply first, then those of the whole image. With coordinate
    systems, the latter lead to other systems. Raises ValueError where one is invalid.
    """
    steps = list(dataset.get("coordinateTransformations", []))
    if system is None:
        steps += multiscale.get("coordinateTransformations", [])
    elif any(_system_of(one, "output") for one in steps):
        steps = _way_to(steps, system, multiscale)
    scale: list[float] | None = None
    shift: list[float] | None = None
    for kind, values in _flat(steps, dimensions):
        if kind == "scale":
            scale = [a * b for a, b in zip(scale or [1.0] * dimensions, values, strict=True)]
            shift = shift and [a * b for a, b in zip(shift, values, strict=True)]
        else:
            shift = [a + b for a, b in zip(shift or [0.0] * dimensions, values, strict=True)]
    return scale, shift


def _flat(
    steps: Sequence[Mapping[str, Any]], dimensions: int, depth: int = 0
) -> Iterator[tuple[str, list[float]]]:
    """Yield each scale and translation in the order in which they apply."""
    if depth > _DEEPEST:
        raise NotAlongAxesError("sequences that are nested too deeply")
    for step in steps:
        kind = str(step["type"])
        if kind == "sequence":
            yield from _flat(step["transformations"], dimensions, depth + 1)
        elif kind == "bijection":
            yield from _flat([step["forward"]], dimensions, depth + 1)
        elif kind in ("affine", "rotation"):
            yield from _of_matrix(kind, step.get(kind), dimensions)
        elif kind in ("scale", "translation"):
            values = [float(value) for value in step.get(kind, [])]
            if len(values) != dimensions:
                raise ValueError(
                    f"coordinateTransformations: found {kind} of {len(values)} numbers "
                    f"for {dimensions} axes"
                )
            yield kind, values
        elif kind != "identity":
            raise NotAlongAxesError(repr(kind[:40]))


def _of_matrix(kind: str, rows: Any, dimensions: int) -> Iterator[tuple[str, list[float]]]:
    """Yield the scale and the translation of a matrix without rotation and shear."""
    columns = dimensions + (kind == "affine")
    matrix = np.array(rows, float) if isinstance(rows, list) else np.zeros(0)
    if matrix.size != dimensions * columns:
        raise NotAlongAxesError(f"{kind!r} of other than {dimensions} x {columns} numbers")
    matrix = matrix.reshape(dimensions, columns)
    scale = np.diag(matrix[:, :dimensions])
    if (matrix[:, :dimensions] != np.diag(scale)).any():
        raise NotAlongAxesError(f"{kind!r} that rotates or shears the grid")
    yield "scale", scale.tolist()
    if kind == "affine":
        yield "translation", matrix[:, dimensions].tolist()


def _repeated(
    multiscale: Mapping[str, Any], placements: Sequence[Placement], system: str | None
) -> tuple[str, ...]:
    """Return a note if the image's scale repeats that of its finest level."""
    if system is not None or not placements or placements[0][0] is None:
        return ()
    own = _scale_in(multiscale["datasets"][0])
    if own is None or own != _scale_in(multiscale) or set(own) == {1.0}:
        return ()
    return (
        "voxel spacing: the image and its finest level state the same scale: the two are "
        "multiplied, by the specification of OME-Zarr; if one just repeats the other, "
        "--spacing-um z,y,x replaces the product",
    )


def _scale_in(table: Mapping[str, Any]) -> list[float] | None:
    steps = table.get("coordinateTransformations", [])
    found = [step.get("scale") for step in steps if step.get("type") == "scale"]
    return [float(value) for value in found[0]] if len(found) == 1 and found[0] else None
