"""Check a stage by all validators of USD and by checks of our own.

USD's validators find missing files (also in unselected variants) and faults of metadata, API
schemas and nesting. The checks in this module find faults that USD's validators miss:

- layers with different units, and selected variants that do not exist
- wrong counts, indices and extents
- names that two drawn prims share
- fields whose grid is missing in their .vdb

The output of usd/write_stage.py passes all validators without exceptions.

All checks run once for each level of detail, since each level has its own geometry. Each run also
selects another transfer function of the channels. Meshes and volumes are always both active.
"""

import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Sdf, Tf, Usd, UsdGeom, UsdUtils, UsdValidation, UsdVol

from stereocell.formats.vdb_read import read_vdb_head
from stereocell.model.errors import StageError
from stereocell.usd.layer import CHANNEL_API, METERS_PER_UNIT, UP_AXIS
from stereocell.usd.typed_values import one_line, read_as

_Types = Sdf.ValueTypeNames
# Attributes of a volume's box, without their namespace
_BOX = {"boundsMin": _Types.Double3, "boundsMax": _Types.Double3, "atlasSize": _Types.Int3}
_ALL_SHOWN = {"representation": "both"}
_TOLERANCE = 1e-4  # tolerance for extents, which are float32, as a share of the box's size


@dataclass(frozen=True, slots=True)
class Finding:
    """One fault. `rule` names the check; `where` is the path of a prim, a property or a layer."""

    rule: str
    where: str
    message: str

    def __str__(self) -> str:
        return f"{self.where}: {self.message} ({self.rule})"


def validate_stage(path: Path) -> list[Finding]:
    """Return the faults of a stage with all its payloads; empty: the stage is valid."""
    quiet = UsdUtils.CoalescingDiagnosticDelegate()  # keeps USD from printing the findings, too
    findings: list[Finding] = []
    try:
        stage = Usd.Stage.Open(str(path))
        findings += [*_check_selections(stage), *_check_all(stage)]
        passes = _select_variants(stage, 0)
        for turn in range(passes):
            _select_variants(stage, turn)
            findings += _check_all(stage)
    except Tf.ErrorException as error:  # an unreadable layer ends the check
        findings.append(Finding("open", str(path), one_line(error)))
    del quiet
    return list(dict.fromkeys(findings))


def validate_usdz(path: Path) -> list[Finding]:
    """Return the faults of a specimen.usdz, found by USD's validators and by our own checks.

    Its unit must be the metre, as AR viewers expect. It has no variants, so one run is enough.
    """
    quiet = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        return [Finding("open", str(path), one_line(error))]
    unit, axis = UsdGeom.GetStageMetersPerUnit(stage), UsdGeom.GetStageUpAxis(stage)
    findings = [*_run_validators(stage), *_check_names(stage)]
    if (unit, axis) != (1.0, UP_AXIS):
        message = f"metersPerUnit is {unit} and upAxis is {axis}, expected 1.0 and {UP_AXIS}"
        findings.append(Finding("units", str(path), message))
    for prim in stage.Traverse():
        if prim.IsA(UsdGeom.Mesh):
            try:
                findings += _check_mesh(UsdGeom.Mesh(prim))
            except StageError as error:  # a value of another type
                findings.append(Finding("type", _place(prim), str(error)))
        elif prim.IsA(UsdVol.Volume):
            message = "found a volume, expected none, since no program draws volumes of usdz"
            findings.append(Finding("volume", _place(prim), message))
    del quiet
    return findings


def _check_all(stage: Usd.Stage) -> Iterator[Finding]:
    """Yield the faults of the stage with its currently selected variants."""
    yield from _check_layers(stage)
    yield from _run_validators(stage)
    yield from _check_names(stage)
    boxes = UsdGeom.BBoxCache(Usd.TimeCode.Default(), [UsdGeom.Tokens.default_])
    for prim in stage.Traverse():
        try:
            yield from _check_prim(prim, boxes)
        except StageError as error:  # a value of another type
            yield Finding("type", _place(prim), str(error))


def _check_prim(prim: Usd.Prim, boxes: UsdGeom.BBoxCache) -> Iterator[Finding]:
    if prim.IsA(UsdGeom.Mesh):
        yield from _check_mesh(UsdGeom.Mesh(prim))
    elif prim.IsA(UsdVol.Volume):
        yield from _check_volume(UsdVol.Volume(prim))
    elif prim.HasAPI(UsdGeom.ModelAPI):
        yield from _check_extents_hint(UsdGeom.ModelAPI(prim), boxes)
    elif CHANNEL_API in prim.GetAppliedSchemas():
        yield from _check_windows(prim)
        yield from _check_opacity(prim)


def _run_validators(stage: Usd.Stage) -> Iterator[Finding]:
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    for error in UsdValidation.ValidationContext(validators).Validate(stage):
        sites = ", ".join(_name_site(site) for site in error.GetSites())
        yield Finding(str(error.GetIdentifier()), sites, " ".join(error.GetMessage().split()))


def _name_site(site: UsdValidation.ValidationErrorSite) -> str:
    if site.IsPrim():
        return str(site.GetPrim().GetPath())
    if site.IsProperty():
        return str(site.GetProperty().GetPath())
    return _name_layer(site.GetLayer()) if site.IsValidSpecInLayer() else "stage"


def _name_layer(layer: Sdf.Layer) -> str:
    return str(layer.realPath or layer.identifier)


def _check_layers(stage: Usd.Stage) -> Iterator[Finding]:
    """Yield layers with wrong units, up axis or default prim: USD does not convert them."""
    session = stage.GetSessionLayer()
    for layer in sorted(stage.GetUsedLayers(), key=_name_layer):
        if layer == session:
            continue
        root, where = layer.pseudoRoot, _name_layer(layer)
        unit = root.GetInfo("metersPerUnit") if root.HasInfo("metersPerUnit") else None
        if unit is None or not math.isclose(unit, METERS_PER_UNIT):
            yield Finding("units", where, f"metersPerUnit is {unit}, expected {METERS_PER_UNIT}")
        axis = root.GetInfo("upAxis") if root.HasInfo("upAxis") else None
        if axis != UP_AXIS:
            yield Finding("units", where, f"upAxis is {axis}, expected {UP_AXIS}")
        if not layer.defaultPrim or not layer.GetPrimAtPath(f"/{layer.defaultPrim}"):
            found = repr(str(layer.defaultPrim))
            yield Finding(
                "defaultPrim", where, f"defaultPrim is {found}, expected the name of a root prim"
            )


def _check_names(stage: Usd.Stage) -> Iterator[Finding]:
    """Yield prims whose name another drawn prim has, too.

    Programs that flatten the tree would rename one of them.
    """
    leaves = [prim for prim in stage.Traverse() if prim.IsA(UsdGeom.Gprim)]
    counts = Counter(prim.GetName() for prim in leaves)
    for prim in leaves:
        if counts[prim.GetName()] > 1:
            found = counts[prim.GetName()]
            message = f"found {found} prims with the name {prim.GetName()}, expected 1"
            yield Finding("names", _place(prim), message)


def _check_selections(stage: Usd.Stage) -> Iterator[Finding]:
    for prim in stage.TraverseAll():
        sets = prim.GetVariantSets()
        for name, selected in sorted(sets.GetAllVariantSelections().items()):
            known = list(sets.GetVariantSet(name).GetVariantNames())
            if selected and selected not in known:
                message = f"variant set {name} selects {selected!r}, expected one of {known}"
                yield Finding("variants", str(prim.GetPath()), message)


def _select_variants(stage: Usd.Stage, turn: int) -> int:
    """Select variant number `turn` of every variant set, in the session layer.

    A set with fewer variants keeps its last one. The representation is always `both`. Returns the
    number of turns: the size of the largest set.
    """
    session = stage.GetSessionLayer()
    chosen: list[tuple[Sdf.Path, str, str]] = []
    turns = 0
    for prim in stage.TraverseAll():
        for name in prim.GetVariantSets().GetNames():
            known = prim.GetVariantSets().GetVariantSet(name).GetVariantNames()
            if name not in _ALL_SHOWN and known:
                turns = max(turns, len(known))
                chosen.append((prim.GetPath(), name, known[min(turn, len(known) - 1)]))
            elif name in _ALL_SHOWN and _ALL_SHOWN[name] in known:
                chosen.append((prim.GetPath(), name, _ALL_SHOWN[name]))
    with Sdf.ChangeBlock():
        for path, name, variant in chosen:
            Sdf.CreatePrimInLayer(session, path).variantSelections[name] = variant
    return turns


def _check_mesh(mesh: UsdGeom.Mesh) -> Iterator[Finding]:
    where = _place(mesh.GetPrim())
    points = _array(mesh.GetPointsAttr(), _Types.Point3fArray)
    counts, indices = (
        _array(mesh.GetFaceVertexCountsAttr(), _Types.IntArray),
        _array(mesh.GetFaceVertexIndicesAttr(), _Types.IntArray),
    )
    if not np.isfinite(points).all():
        yield Finding("mesh", where, "found points that are not finite, expected finite numbers")
        return
    if counts.sum() != len(indices) or (counts < 3).any():
        message = (
            f"found {len(indices)} indices, expected {int(counts.sum())}, in faces of 3 or more"
        )
        yield Finding("mesh", where, message)
        return
    if len(indices) and (indices.min() < 0 or indices.max() >= len(points)):
        span = f"found indices from {int(indices.min())} to {int(indices.max())}"
        yield Finding("mesh", where, f"{span}, expected 0 to {len(points) - 1}")
        return
    sizes = {"vertex": len(points), "varying": len(points), "faceVarying": len(indices)}
    sizes |= {"uniform": len(counts), "constant": 1}
    normals = _array(mesh.GetNormalsAttr(), _Types.Normal3fArray)
    expected = sizes[mesh.GetNormalsInterpolation()]
    if len(normals) != expected or not np.isfinite(normals).all():
        message = f"found {len(normals)} normals, expected {expected} finite ones"
        yield Finding("mesh", where, message)
    elif _is_inside_out(mesh, points, counts, indices, normals):
        message = "found normals on the back of most faces, expected normals on the front"
        yield Finding("mesh", where, message)
    for primvar in UsdGeom.PrimvarsAPI(mesh).GetPrimvarsWithValues():
        found = len(primvar.ComputeFlattened() or ())
        wanted = sizes[primvar.GetInterpolation()] * primvar.GetElementSize()
        if primvar.GetInterpolation() != UsdGeom.Tokens.constant and found != wanted:
            message = f"primvar {primvar.GetPrimvarName()} has {found} values, expected {wanted}"
            yield Finding("mesh", where, message)
    if len(points):
        box = np.stack([points.min(axis=0), points.max(axis=0)])
        yield from _check_extent(mesh, where, box, np.zeros(3))


def _is_inside_out(
    mesh: UsdGeom.Mesh,
    points: NDArray[np.float64],
    counts: NDArray[np.float64],
    indices: NDArray[np.float64],
    normals: NDArray[np.float64],
) -> bool:
    """Return whether most faces of a triangle mesh point against the normals at their vertices.

    This happens if a mesh is mirrored without reversing its faces.

    points   (n, 3)
    counts   (m,), corners of each face
    indices  (3 m,), vertices of the faces
    normals  (n, 3), at the vertices
    """
    if len(counts) == 0 or (counts != 3).any() or len(normals) != len(points):
        return False
    corners = indices.astype(np.int64).reshape(-1, 3)
    a, b, c = (points[corners[:, k]] for k in range(3))
    faces = np.cross(b - a, c - a)
    if mesh.GetOrientationAttr().Get() == UsdGeom.Tokens.leftHanded:
        faces = -faces
    around = normals[corners[:, 0]] + normals[corners[:, 1]] + normals[corners[:, 2]]
    return float(np.einsum("mk,mk->", faces, around)) < 0


def _check_volume(volume: UsdVol.Volume) -> Iterator[Finding]:
    prim = volume.GetPrim()
    where = _place(prim)
    fields = volume.GetFieldPaths()
    if not fields and not prim.HasAttribute("stereocell:atlas"):
        message = "found no field and no stereocell:atlas, expected one of them"
        yield Finding("volume", where, message)
    files: set[str] = set()
    for name, path in sorted(fields.items()):
        asset = UsdVol.OpenVDBAsset(prim.GetStage().GetPrimAtPath(path))
        if asset:
            file = read_as(asset.GetFilePathAttr(), _Types.Asset)
            files.add(file.resolvedPath or file.path if file else "")
            yield from _check_grid(prim, asset)
        else:
            message = f"found no OpenVDBAsset at {path}, expected one for the field {name}"
            yield Finding("volume", where, message)
    if len(files) > 1:
        message = f"fields name {len(files)} VDB files, expected 1, since programs read only one"
        yield Finding("volume", where, message)
    low, high, size, apron = _box_of(prim)
    if low is None or high is None or size is None:
        names = f"stereocell:{', stereocell:'.join(_BOX)}"
        yield Finding("volume", where, f"found no value for one of {names}, expected all")
        return
    cells = np.array(size) - 2 * apron - 1
    box = np.array([low, high])
    if (cells < 1).any() or (box[1] <= box[0]).any():
        message = f"found an atlas of {list(size)} voxels in a box of {box.tolist()}"
        yield Finding("volume", where, f"{message}, expected two or more along each axis")
        return
    # The box goes from voxel centre to voxel centre, but the extent goes to the voxels' faces. So
    # they differ by half a voxel.
    yield from _check_extent(volume, where, box, 0.5 * (box[1] - box[0]) / cells)


def _check_grid(volume: Usd.Prim, asset: UsdVol.OpenVDBAsset) -> Iterator[Finding]:
    """Yield fields whose file lacks the grid or has another spacing: programs then draw nothing."""
    where, file = str(asset.GetPath()), read_as(asset.GetFilePathAttr(), _Types.Asset)
    if file is None or not file.resolvedPath:
        return  # one of USD's validators reports a missing file
    try:
        grids = read_vdb_head(Path(file.resolvedPath))
    except StageError as error:
        yield Finding("grid", where, str(error))
        return
    named = asset.GetFieldNameAttr().Get()
    grid = next((grid for grid in grids if grid.name == named), None)
    if grids and grid is None:
        known = [grid.name for grid in grids]
        yield Finding("grid", where, f"fieldName is {named!r}, expected one of {known} in {file}")
    if grid is None or grid.spacing is None:
        return
    spacing = _voxel_spacing(volume)
    if spacing is not None and not np.allclose(grid.spacing, spacing, rtol=_TOLERANCE, atol=0):
        message = f"found voxels of {grid.spacing.tolist()} in {file}, expected {spacing.tolist()}"
        yield Finding("grid", where, message)


def _voxel_spacing(volume: Usd.Prim) -> NDArray[np.float64] | None:
    """Return the voxel spacing (x, y, z), um, by a volume's attributes; None if it lacks them."""
    low, high, size, apron = _box_of(volume)
    if low is None or high is None or size is None:
        return None
    cells = np.array(size) - 2 * apron - 1
    return (np.array(high) - np.array(low)) / cells if (cells > 0).all() else None


def _box_of(volume: Usd.Prim) -> tuple[Any, Any, Any, int]:
    """Return the corners of a volume's box, its size in voxels, and its apron.

    An attribute that the volume lacks is None, or 0 for the apron.
    """
    low, high, size = (
        read_as(volume.GetAttribute(f"stereocell:{name}"), kind) for name, kind in _BOX.items()
    )
    return low, high, size, read_as(volume.GetAttribute("stereocell:apron"), _Types.Int) or 0


def _check_extent(
    boundable: UsdGeom.Boundable, where: str, box: NDArray[np.float64], slack: NDArray[np.float64]
) -> Iterator[Finding]:
    extent = _array(boundable.GetExtentAttr(), _Types.Float3Array)
    tolerance = slack + _TOLERANCE * max(1e-3, float((box[1] - box[0]).max()))
    if extent.shape != (2, 3) or (np.abs(extent - box) > tolerance).any():
        message = f"extent is {extent.round(4).tolist()}, expected {box.round(4).tolist()}"
        yield Finding("extent", where, message)


def _check_extents_hint(model: UsdGeom.ModelAPI, boxes: UsdGeom.BBoxCache) -> Iterator[Finding]:
    prim = model.GetPrim()
    hint = model.GetExtentsHint()
    drawn = boxes.ComputeUntransformedBound(prim).ComputeAlignedRange()
    if hint is None or drawn.IsEmpty():
        return
    box, shown = np.array(list(hint)[:2]), np.array([list(drawn.GetMin()), list(drawn.GetMax())])
    tolerance = _TOLERANCE * float((box[1] - box[0]).max())
    if (shown[0] < box[0] - tolerance).any() or (shown[1] > box[1] + tolerance).any():
        message = f"extentsHint is {box.round(4).tolist()}, expected a box round"
        message += f" {shown.round(4).tolist()}"
        yield Finding("extent", _place(prim), message)


def _check_windows(prim: Usd.Prim) -> Iterator[Finding]:
    for name in ("window", "volumeWindow"):
        window = read_as(prim.GetAttribute(f"stereocell:{name}"), _Types.Float2)
        if window is not None and not window[0] < window[1]:
            message = f"{name} is {window}, expected the first number below the second"
            yield Finding("look", _place(prim), message)


def _check_opacity(prim: Usd.Prim) -> Iterator[Finding]:
    points = _array(prim.GetAttribute("stereocell:opacityPoints"), _Types.Float2Array)
    rising = bool((np.diff(points[:, 0]) >= 0).all())
    if len(points) < 2 or not rising or points.min() < 0 or points.max() > 1:
        message = (
            f"opacityPoints is {points.tolist()}, expected 2 or more pairs from 0 to 1, rising"
        )
        yield Finding("look", _place(prim), message)


def _place(prim: Usd.Prim) -> str:
    """Return the prim's path and, inside a tile, the selected level of detail."""
    for ancestor in prim.GetPath().GetPrefixes():
        variants = prim.GetStage().GetPrimAtPath(ancestor).GetVariantSets()
        if variants.HasVariantSet("lod"):
            return f"{prim.GetPath()} (lod={variants.GetVariantSelection('lod')})"
    return str(prim.GetPath())


def _array(attribute: Usd.Attribute, kind: Sdf.ValueTypeName) -> NDArray[np.float64]:
    """Return an attribute's value as float64, (n,) or (n, width); n = 0 if it has no value.

    Raises StageError for a value of another type.
    """
    value = read_as(attribute, kind, may_be_nan=True)
    shape = (-1, *np.shape(kind.scalarType.defaultValue))
    return np.asarray([] if value is None else value, dtype=np.float64).reshape(shape)
