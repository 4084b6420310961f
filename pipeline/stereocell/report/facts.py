"""Numbers of a build, read from OUT and summed up for the report."""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from stereocell.building.out_folder import OutFolder
from stereocell.building.surface_cover import lifted_by_tile
from stereocell.building.survey_file import read_survey
from stereocell.isosurface.lifted_by_noise import Lifted
from stereocell.model.tiling import Tile
from stereocell.model.unit import Cover
from stereocell.planning.channels import Channel
from stereocell.planning.plan import Plan
from stereocell.planning.survey import Survey, TileIso
from stereocell.steps.unit_files import cover_of, find_seconds, load_record, lod_file
from stereocell.storage.file_list import sizes_of

PHASES = ("plan", "units", "stage", "bundle")


@dataclass(frozen=True, slots=True)
class LodFacts:
    """One level of detail of one unit; None where the record lacks a number.

    distance_um  99th percentile of the distance between mesh and iso-surface
    bytes        size of the .glb in the bundle, or else of the unit's own file
    mean_um, p95_um, max_um  mean, 95th percentile and maximum of this distance
    faults       number of defects that the exact check of the mesh found
    fallbacks    number of components left as in the finer level, since simplifying made defects
    angle_deg    1st percentile of the triangles' smallest angles
    enclosed     share of the finest surface inside this level or on it, 0..1

    Distances are measured from the mesh and from the iso-surface; the larger one counts.
    """

    triangles: int
    distance_um: float
    bytes: int
    mean_um: float | None = None
    p95_um: float | None = None
    max_um: float | None = None
    faults: int | None = None
    fallbacks: int | None = None
    angle_deg: float | None = None
    enclosed: float | None = None


@dataclass(frozen=True, slots=True)
class UnitFacts:
    """The numbers of one finished unit, which is a channel in a tile.

    directory   folder of the unit's results
    iso_value   voxel value above the background; None: the channel has none
    background  mean of the subtracted background over the tile, voxel values; 0: none
    confidence  0..1, of the iso-value in this tile alone; None: the tile holds no structure
    reason      why there is no surface; empty: there is one
    voxels      size (x, y, z) of the stored volume with its apron, in voxels
    volume_bytes, ktx2_bytes  size of the 8-bit voxels, and of their files in the bundle (0: none)
    cover       how the surface covers the source's voxels; None: the channel has no iso-value
    lifted      number of voxels that only noise lifts above the iso-value; None: unknown
    seconds     time of each step; empty where the record is missing
    """

    tile: Tile
    channel: Channel
    directory: Path
    iso_value: float | None
    background: float
    confidence: float | None
    reason: str
    lods: tuple[LodFacts, ...]
    voxels: tuple[int, int, int]
    volume_bytes: int
    ktx2_bytes: int
    fragments_dropped: int
    cavities_filled: int
    cover: Cover | None
    seconds: dict[str, float]
    lifted: Lifted | None = None

    @property
    def key(self) -> tuple[str, str]:
        """The IDs of tile and channel."""
        return self.tile.id, self.channel.id

    @property
    def name(self) -> str:
        """The tile's ID and the channel's name, `<tile>/<channel>`."""
        return f"{self.tile.id}/{self.channel.name}"

    @property
    def slowest_step(self) -> str:
        """The build step that took longest; empty where no times are recorded."""
        return max(self.seconds, key=lambda step: self.seconds[step], default="")


@dataclass(frozen=True, slots=True)
class StepFacts:
    """Seconds of one build step, over all units; `slowest` is the unit that took `largest`."""

    name: str
    median: float
    largest: float
    slowest: str
    total: float


@dataclass(frozen=True, slots=True)
class FileFacts:
    """Number and size of the files with one suffix in units, stage or bundle."""

    part: str
    suffix: str
    count: int
    bytes: int


@dataclass(frozen=True, slots=True)
class Facts:
    """All numbers of a build.

    phases  seconds of each phase, and which part of the units it ran; empty: all of them
    """

    plan: Plan
    survey: Survey
    units: tuple[UnitFacts, ...]
    phases: dict[str, tuple[float, str]]
    steps: tuple[StepFacts, ...]
    files: tuple[FileFacts, ...]


@dataclass(frozen=True, slots=True)
class Total:
    """Sums over units, with one entry of `lods` for each level of detail."""

    lods: tuple[LodFacts, ...]
    units: int
    voxels: int
    volume_bytes: int
    ktx2_bytes: int
    fragments_dropped: int
    cavities_filled: int


def gather(out_folder: OutFolder) -> Facts:
    """Return the facts of OUT. Raises OutputError where the plan or a unit is missing."""
    plan = out_folder.plan()
    out_folder.require_units_of(plan)
    survey, index = read_survey(out_folder), out_folder.index()
    units = [
        _unit(
            out_folder,
            tile,
            channel,
            index[f"{tile.id}/{channel.id}"],
            survey[channel.id].iso[tile.id],
        )
        for tile in plan.tiles
        for channel in plan.channels
    ]
    lifted = {one.id: lifted_by_tile(out_folder, plan, survey[one.id]) for one in plan.channels}
    units = [replace(unit, lifted=lifted[unit.channel.id].get(unit.tile.id)) for unit in units]
    phases = out_folder.phases()
    return Facts(
        plan=plan,
        survey=survey,
        units=tuple(units),
        phases={
            name: (phases[name]["seconds"], phases[name]["about"])
            for name in PHASES
            if name in phases and phases[name]["key"]
        },
        steps=_steps(units),
        files=_files(out_folder),
    )


def _unit(
    out_folder: OutFolder, tile: Tile, channel: Channel, key: str, found: TileIso
) -> UnitFacts:
    directory = out_folder.unit_dir(f"{tile.id}/{channel.id}", key)
    record = load_record(directory)
    bundle = out_folder.bundle_dir
    lods = []
    for level, lod in enumerate(record["lods"]):
        glb = bundle / "channels" / channel.id / tile.id / f"lod{level}.glb"
        stored = record["files"][lod_file(directory, level).name]["bytes"]
        size = out_folder.size(glb) or stored
        lods.append(_lod(lod, size))
    ktx2 = [bundle / "volumes" / tile.id / f"{channel.id}{end}.ktx2" for end in ("", "_bricks")]
    z, y, x = record["volume"]
    return UnitFacts(
        tile=tile,
        channel=channel,
        directory=directory,
        iso_value=found.value,
        background=found.background,
        confidence=found.confidence,
        reason=record["reason"],
        lods=tuple(lods),
        voxels=(x, y, z),
        volume_bytes=x * y * z,
        ktx2_bytes=sum(map(out_folder.size, ktx2)),
        fragments_dropped=record["fragments_dropped"],
        cavities_filled=record["cavities_filled"],
        cover=cover_of(record),
        seconds=find_seconds(directory),
    )


def _lod(record: dict[str, Any], size: int) -> LodFacts:
    q = record["quality"]
    return LodFacts(
        triangles=record["triangles"],
        distance_um=record["distance_um"],
        bytes=size,
        mean_um=q and max(q["away"]["mean"], q["back"]["mean"]),
        p95_um=q and max(q["away"]["p95"], q["back"]["p95"]),
        max_um=q and max(q["away"]["max"], q["back"]["max"]),
        faults=q and q["faults"],
        fallbacks=q and q["fallbacks"],
        angle_deg=q and q["angle_deg"],
        enclosed=q and q["enclosed"],
    )


def sum_up(units: Iterable[UnitFacts]) -> Total:
    """Return the sums over some units, by level of detail."""
    units = list(units)
    levels = max((len(unit.lods) for unit in units), default=0)
    lods = []
    for level in range(levels):
        lods.append(_all_of([unit.lods[level] for unit in units if level < len(unit.lods)]))
    return Total(
        lods=tuple(lods),
        units=len(units),
        voxels=sum(int(np.prod(unit.voxels, dtype=np.int64)) for unit in units),
        volume_bytes=sum(unit.volume_bytes for unit in units),
        ktx2_bytes=sum(unit.ktx2_bytes for unit in units),
        fragments_dropped=sum(unit.fragments_dropped for unit in units),
        cavities_filled=sum(unit.cavities_filled for unit in units),
    )


def _all_of(lods: Sequence[LodFacts]) -> LodFacts:
    """Return one level of detail of several units: sums, largest distances, smallest angle."""

    def known(name: str) -> list[Any]:
        return [value for lod in lods if (value := getattr(lod, name)) is not None]

    return LodFacts(
        triangles=sum(lod.triangles for lod in lods),
        distance_um=max(lod.distance_um for lod in lods),
        bytes=sum(lod.bytes for lod in lods),
        mean_um=max(known("mean_um"), default=None),
        p95_um=max(known("p95_um"), default=None),
        max_um=max(known("max_um"), default=None),
        faults=sum(known("faults")) if known("faults") else None,
        fallbacks=sum(known("fallbacks")) if known("fallbacks") else None,
        angle_deg=min(known("angle_deg"), default=None),
        enclosed=min(known("enclosed"), default=None),
    )


@dataclass(slots=True)
class _Spent:
    seconds: list[float] = field(default_factory=list)
    largest: float = -1.0
    slowest: str = ""


def _steps(units: Sequence[UnitFacts]) -> tuple[StepFacts, ...]:
    """Return the times of the build steps, in the order in which units run them."""
    spent: dict[str, _Spent] = defaultdict(_Spent)
    for unit in sorted(units, key=lambda unit: -len(unit.seconds)):  # most steps first
        for step, seconds in unit.seconds.items():
            entry = spent[step]
            entry.seconds.append(seconds)
            if seconds > entry.largest:
                entry.largest, entry.slowest = seconds, unit.name
    return tuple(
        StepFacts(step, median(s.seconds), s.largest, s.slowest, sum(s.seconds))
        for step, s in spent.items()
    )


def _files(out_folder: OutFolder) -> tuple[FileFacts, ...]:
    """Return number and bytes of the files in units, stage and bundle, by suffix, largest first."""
    rows = []
    for part in (out_folder.out / "units", out_folder.stage_dir, out_folder.bundle_dir):
        sizes: dict[str, list[int]] = defaultdict(list)
        for path, size in sizes_of(part).items():
            name = Path(path)
            if not name.name.startswith("."):
                sizes[name.suffix.removeprefix(".") or name.name].append(size)
        kinds = [FileFacts(part.name, suffix, len(n), sum(n)) for suffix, n in sizes.items()]
        rows += sorted(kinds, key=lambda kind: (-kind.bytes, kind.suffix))
    return tuple(rows)
