"""Tissue classes as channels of a build: learned in the planned region, stored in OUT/tissue.

Each class becomes a channel of 8-bit probabilities: OUT/tissue/classes.ome.zarr, a second source in
the plan. Its window is 0..255; its surface lies at probability 1/2.
"""

import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stereocell.building.input_unchanged import require_input, require_still
from stereocell.building.model_process import ModelBounds, opened_network
from stereocell.building.out_folder import OutFolder
from stereocell.building.own_parts import require_own_places, require_own_tissue
from stereocell.building.replaced_plan import replace_plan
from stereocell.building.sealed_documents import require_documents
from stereocell.engine.run import console
from stereocell.engine.step_record import libraries_of
from stereocell.formats.ome_zarr_write import write_probabilities
from stereocell.model.errors import OutputError, SourceError, UsageError
from stereocell.model.version import GENERATOR
from stereocell.planning.channels import GREY_MATTER, PALETTE, WHITE_MATTER, Channel
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import voxels_of
from stereocell.planning.provenance import provenance_record
from stereocell.steps.learn_tissue import LearnTissue
from stereocell.steps.open_source import SourceRef, open_source
from stereocell.steps.tissue_files import (
    FOLDER,
    RECORD,
    VOXELS,
    digests_of,
    read_whole,
)
from stereocell.storage.atomic_write import replacing_folder
from stereocell.storage.json_files import write_json, write_sealed
from stereocell.storage.shell_commands import fill_in
from stereocell.tissue.classify import AUTO_CLASSES, TissueOptions
from stereocell.tissue.onnx_classifier import Network

LEVEL = 127.5  # iso-value, 0..255: probability 1/2
MAX_VOXELS = 250_000_000  # largest region to learn in, voxels; about 40 bytes each
# names and colours (linear RGB) of three classes in a head, by rising T1 intensity
HEAD = (
    ("CSF", (0.03, 0.3, 1.0)),
    (GREY_MATTER, (1.0, 0.22, 0.1)),
    (WHITE_MATTER, (0.95, 0.85, 0.45)),
)


@dataclass(frozen=True, slots=True)
class TissueRequest:
    """The options of `stereocell tissue`.

    classes     number of classes; None: auto, or the model's number
    channel     of the input, by name or index; empty: the first
    model       the user's ONNX file; None: the classes are learned
    everywhere  learn in all voxels outside the background; else, in MR, inside the brain
    bounds      the most time and memory of the model
    """

    classes: int | Literal["auto"] | None = None
    channel: str = ""
    model: Path | None = None
    everywhere: bool = False
    bounds: ModelBounds = ModelBounds()  # noqa: RUF009  (frozen)


@dataclass(frozen=True, slots=True)
class _Class:
    name: str
    color: tuple[float, float, float]
    intensity: float | None  # mean, bias removed; None: not known of a network
    probabilities: NDArray[np.uint8]


def parse_classes(text: str) -> int | Literal["auto"]:
    """Return the value of `--classes`. Raises UsageError where it is invalid."""
    if text == "auto":
        return "auto"
    if not text.isdecimal() or int(text) not in AUTO_CLASSES:
        ends = AUTO_CLASSES[0], AUTO_CLASSES[-1]
        raise UsageError(f"--classes is {text!r}, expected {ends[0]} to {ends[1]}, or auto")
    return int(text)


def add_tissue(out: Path, request: TissueRequest) -> Plan:
    """Learn the classes, write OUT/tissue, and replace earlier ones in the plan.

    Classes are not learned again where OUT/tissue is whole and made from the same voxels and
    options, by the same VERSION of `LearnTissue`.

    Raises StereoCellError; plan and OUT/tissue are unchanged then.
    """
    out_folder = OutFolder(out)
    require_documents(out_folder, "tissue")
    there = out_folder.plan()
    require_own_tissue(out_folder)
    # classes that are learned again may be the same, so that the plan and the stage stay
    require_own_places(out_folder, is_same_plan=any(one.source for one in there.channels))
    plan = without_tissue(there)
    channel = _find_channel(plan, request.channel)
    voxels = math.prod(plan.region.shape)
    if voxels > MAX_VOXELS:
        raise UsageError(
            f"tissue: the region holds {voxels:,} voxels, expected at most {MAX_VOXELS:,}: plan a "
            "coarser --level or a smaller --region"
        )
    with ExitStack() as stack:
        network = None
        if request.model is not None:
            network = stack.enter_context(opened_network(request.model, request.bounds))
        return _add(out_folder, plan, channel, request, network)


def _add(
    out_folder: OutFolder,
    plan: Plan,
    channel: Channel,
    request: TissueRequest,
    network: Network | None,
) -> Plan:
    out = out_folder.out
    if network is not None and request.classes not in (None, "auto", network.count):
        raise UsageError(
            f"--classes is {request.classes}, and {network.name} has {network.count}: expected the "
            "same, or no --classes"
        )
    is_brain = plan.modality == "MR" and not request.everywhere
    options = TissueOptions(classes=request.classes or "auto", brain=is_brain)
    settings = asdict(options) if network is None else network.settings()
    step = LearnTissue(voxels_of(plan, channel), plan.region, channel.name, settings)
    record = _find_learned(out / FOLDER, step.key)
    if record is None:
        record = _learn(out_folder, plan, step, options, network)
    plan = with_tissue(plan, out, record)
    require_own_places(out_folder, is_same_plan=out_folder.plan() == plan)
    replace_plan(out_folder, plan)
    write_sealed(out_folder.provenance_file, provenance_record(plan))
    return plan


def without_tissue(plan: Plan) -> Plan:
    """Return the plan of the input's own channels."""
    own = tuple(channel for channel in plan.channels if not channel.source)
    added = {channel.name for channel in plan.channels if channel.source}
    values = {name: v for name, v in plan.settings.iso_values.items() if name not in added}
    return replace(plan, channels=own, settings=replace(plan.settings, iso_values=values))


def with_tissue(plan: Plan, out: Path, record: dict[str, Any]) -> Plan:
    """Return the plan with a channel for each class of OUT/tissue."""
    fingerprint = open_source(SourceRef(_source_in(out), 0, ())).fingerprint
    _require_free([one["name"] for one in record["classes"]], plan)
    return _with_classes(plan, _source_in(out), fingerprint, record)


def _source_in(out: Path) -> str:
    return str((out / FOLDER / VOXELS).resolve())


def _with_classes(plan: Plan, source: str, fingerprint: str, record: dict[str, Any]) -> Plan:
    added = []
    for index, one in enumerate(record["classes"]):
        red, green, blue = one["color"]
        added.append(Channel(index, one["name"], (red, green, blue), source, fingerprint))
    values = {**plan.settings.iso_values, **{channel.name: LEVEL for channel in added}}
    settings = replace(plan.settings, iso_values=values)
    return replace(plan, channels=(*plan.channels, *added), settings=settings)


def _find_learned(folder: Path, key: str) -> dict[str, Any] | None:
    """Return the record of OUT/tissue if it has this key and is whole; print which."""
    if not folder.exists():
        return None
    try:
        record = read_whole(folder)
    except OutputError as fault:
        line = fill_in(str(fault), {"OUT": str(folder.parent)})
        console.print(f"tissue: {line}", markup=False, soft_wrap=True)
        return None
    if record["key"] != key:
        return None
    console.print("tissue: up to date")
    return record


def _learn(
    out_folder: OutFolder,
    plan: Plan,
    step: LearnTissue,
    options: TissueOptions,
    network: Network | None,
) -> dict[str, Any]:
    require_input(plan)
    learned = step.learn(options, network)
    require_still(plan, again="stereocell tissue OUT")
    names = learned.names or _names(plan, len(learned.intensities), options.brain)
    classes = [
        _Class(name, color, intensity, np.rint(255 * part).astype(np.uint8))
        for (name, color), intensity, part in zip(
            _colored(names, plan), learned.intensities, learned.probabilities, strict=True
        )
    ]
    _require_free([one.name for one in classes], plan)
    voxel_mm3 = math.prod(length / 1000 for length in plan.spacing_um)
    record: dict[str, Any] = {
        "format": "stereocell-tissue",
        "version": 1,
        "generator": GENERATOR,
        "key": step.key,
        "fingerprint": plan.fingerprint,
        "channel": step.channel,
        "settings": dict(step.settings),
        "bic": dict(learned.bic),
        "classes": [
            {
                "name": one.name,
                "color": list(one.color),
                "intensity": one.intensity,
                "volume_mm3": float(one.probabilities.sum(dtype=np.float64) / 255 * voxel_mm3),
            }
            for one in classes
        ],
        "libraries": libraries_of(LearnTissue.__name__),
    }
    shape = open_source(step.voxels.ref).levels[plan.level].shape
    # Checks the plan before anything is written. Its fingerprint is a placeholder of equal length.
    out_folder.require_readable(_with_classes(plan, _source_in(out_folder.out), "0" * 64, record))
    with replacing_folder(out_folder.out / FOLDER) as folder:
        write_probabilities(
            folder / VOXELS,
            [one.probabilities for one in classes],
            channels=[(one.name, one.color) for one in classes],
            start=plan.region.start,
            shape=shape,
            spacing_um=plan.spacing_um,
            origin_um=plan.origin_um,
        )
        write_json(folder / RECORD, {**record, "files": digests_of(folder)})
    open_source.cache_clear()  # the same address holds another volume now
    return record


def _find_channel(plan: Plan, wanted: str) -> Channel:
    if not wanted:
        return plan.channels[0]
    for channel in plan.channels:
        if wanted in (channel.name, channel.id):
            return channel
    for channel in plan.channels:
        if wanted == str(channel.index):
            return channel
    raise UsageError(
        f"--channel is {wanted!r}, expected one of {', '.join(c.name for c in plan.channels)}, or "
        f"an index of {', '.join(str(c.index) for c in plan.channels)}"
    )


def _require_free(names: Sequence[str], plan: Plan) -> None:
    """Raise SourceError where a class has the name of one of the input's channels."""
    taken = {channel.name for channel in plan.channels}
    for name in names:
        if name in taken:
            raise SourceError(
                f"{plan.name}: has a channel {name!r} of its own, expected none of that name"
            )


def _names(plan: Plan, count: int, is_brain: bool) -> list[str]:
    if is_brain and count == len(HEAD):
        return [name for name, _ in HEAD]
    return [f"tissue {k + 1}" for k in range(count)]


def _colored(names: Sequence[str], plan: Plan) -> list[tuple[str, tuple[float, float, float]]]:
    """Return each name with a colour (linear RGB) of its own, not a channel's of the input."""
    known = dict(HEAD)
    taken = {channel.color for channel in plan.channels}
    free = [color for color in PALETTE if color not in taken] or list(PALETTE)
    return [(name, known.get(name, free[k % len(free)])) for k, name in enumerate(names)]
