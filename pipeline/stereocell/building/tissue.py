"""Add tissue classes to a build: learn them in the planned region and store them in OUT/tissue.

Each class becomes a channel of probabilities in 8 bits, with the window 0..255 and the surface at
probability 1/2. Its source is OUT/tissue/classes.ome.zarr, a second source in the plan.
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from stereocell.building.input_unchanged import require_input, require_still
from stereocell.building.model_process import ModelBounds, opened_network
from stereocell.building.out_folder import OutFolder
from stereocell.building.own_parts import require_own_places, require_own_tissue
from stereocell.building.replaced_plan import replace_plan
from stereocell.building.sealed_documents import require_documents
from stereocell.engine.run import console
from stereocell.model.errors import SourceError, UsageError
from stereocell.planning.channels import PALETTE, Channel
from stereocell.planning.plan import Plan
from stereocell.planning.plan_source import voxels_of
from stereocell.planning.provenance import provenance_record
from stereocell.steps.learn_tissue import LearnTissue
from stereocell.steps.open_source import SourceRef, forget_sources, open_source
from stereocell.steps.tissue_files import FOLDER, VOXELS, find_fault, read_record
from stereocell.storage.json_files import write_sealed
from stereocell.storage.shell_commands import fill_in
from stereocell.tissue.classify import AUTO_CLASSES, TissueOptions
from stereocell.tissue.onnx_classifier import Network

LEVEL = 127.5  # iso-value of a class, 0..255, at probability 1/2
MAX_VOXELS = 250_000_000  # voxels; largest region to learn in, at about 40 bytes each


@dataclass(frozen=True, slots=True)
class TissueRequest:
    """The options of `stereocell tissue`.

    classes     number of classes; None: auto, or the model's number
    channel     channel of the input, by name or index; empty: the first
    model       the user's ONNX file; None: the classes are learned
    everywhere  whether to learn in all voxels outside the background; otherwise, in MR, only inside
                the brain
    bounds      bounds on the model's time and memory
    """

    classes: int | Literal["auto"] | None = None
    channel: str = ""
    model: Path | None = None
    everywhere: bool = False
    bounds: ModelBounds = ModelBounds()  # noqa: RUF009  (frozen)


def parse_classes(text: str) -> int | Literal["auto"]:
    """Return the value of `--classes`. Raises UsageError if it is invalid."""
    if text == "auto":
        return "auto"
    if not text.isdecimal() or int(text) not in AUTO_CLASSES:
        ends = AUTO_CLASSES[0], AUTO_CLASSES[-1]
        raise UsageError(f"--classes is {text!r}, expected {ends[0]} to {ends[1]}, or auto")
    return int(text)


def add_tissue(out: Path, request: TissueRequest) -> Plan:
    """Learn the classes, write OUT/tissue, and replace earlier classes in the plan.

    Classes are not learned again if OUT/tissue is complete and was made from the same voxels and
    options by the same VERSION of `LearnTissue`.

    Raises StereoCellError, and leaves the plan and OUT/tissue unchanged then.
    """
    out_folder = OutFolder(out)
    require_documents(out_folder, "tissue")
    there = out_folder.plan()
    require_own_tissue(out_folder)
    # Learning again may give the same classes, so the plan and the stage may stay the same.
    require_own_places(out_folder, is_same_plan=any(one.source for one in there.channels))
    plan = without_tissue(there)
    channel = _find_channel(plan, request.channel)
    voxels = math.prod(plan.region.shape)
    if voxels > MAX_VOXELS:
        raise UsageError(
            f"tissue: found {voxels:,} voxels in the region, expected at most {MAX_VOXELS:,}: plan "
            "a coarser --level or a smaller --region"
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
            f"--classes is {request.classes}, expected {network.count}, the number of classes of "
            f"{network.name}, or no --classes"
        )
    method: TissueOptions | Network
    if network is None:
        is_brain = plan.modality == "MR" and not request.everywhere
        method = TissueOptions(classes=request.classes or "auto", brain=is_brain)
    else:
        method = network
    step = LearnTissue(
        voxels_of(plan, channel), plan.region, channel.name, method, _free_colors(plan)
    )
    _keep(out_folder, plan, step)
    record = read_record(out / FOLDER)
    plan = with_tissue(plan, out, record)
    require_own_places(out_folder, is_same_plan=out_folder.plan() == plan)
    replace_plan(out_folder, plan)
    write_sealed(out_folder.provenance_file, provenance_record(plan))
    return plan


def without_tissue(plan: Plan) -> Plan:
    """Return the plan with only the input's own channels."""
    own = tuple(channel for channel in plan.channels if not channel.source)
    added = {channel.name for channel in plan.channels if channel.source}
    values = {name: v for name, v in plan.settings.iso_values.items() if name not in added}
    return replace(plan, channels=own, settings=replace(plan.settings, iso_values=values))


def with_tissue(plan: Plan, out: Path, record: Mapping[str, Any]) -> Plan:
    """Return the plan with a channel for each class of OUT/tissue."""
    fingerprint = open_source(SourceRef(_source_in(out), 0, ())).fingerprint
    _require_free([one["name"] for one in record["classes"]], plan)
    return _with_classes(plan, _source_in(out), fingerprint, record)


def _source_in(out: Path) -> str:
    return str((out / FOLDER / VOXELS).resolve())


def _with_classes(plan: Plan, source: str, fingerprint: str, record: Mapping[str, Any]) -> Plan:
    added = []
    for index, one in enumerate(record["classes"]):
        red, green, blue = one["color"]
        added.append(Channel(index, one["name"], (red, green, blue), source, fingerprint))
    values = {**plan.settings.iso_values, **{channel.name: LEVEL for channel in added}}
    settings = replace(plan.settings, iso_values=values)
    return replace(plan, channels=(*plan.channels, *added), settings=settings)


def _keep(out_folder: OutFolder, plan: Plan, step: LearnTissue) -> None:
    """Learn the classes unless OUT/tissue holds them, and print what was done."""
    folder = out_folder.out / FOLDER
    if step.is_whole(folder):
        console.print("tissue: up to date")
        return
    if folder.exists() and (fault := find_fault(folder)) is not None:
        line = fill_in(fault, {"OUT": str(out_folder.out)})
        console.print(f"tissue: {line}", markup=False, soft_wrap=True)
    _learn(out_folder, plan, step)


def _learn(out_folder: OutFolder, plan: Plan, step: LearnTissue) -> None:
    """Write OUT/tissue. The input and the plan are checked before anything is written."""
    require_input(plan)
    found = step.run()
    require_still(plan, again="stereocell tissue OUT")
    _require_free([one.name for one in found.classes], plan)
    # The fingerprint is not known yet; zeros of the same length stand in its place.
    planned = _with_classes(plan, _source_in(out_folder.out), "0" * 64, found.record)
    out_folder.require_readable(planned)
    step.FORM.write(out_folder.out / FOLDER, found)
    forget_sources()  # OUT/tissue, which may be open as a source, holds another volume now


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
    """Raise SourceError if a class has the name of one of the input's channels."""
    taken = {channel.name for channel in plan.channels}
    for name in names:
        if name in taken:
            raise SourceError(
                f"{plan.name}: found a channel with the name {name!r}, expected a name that no "
                "class of tissue has: rename the channel, or plan without it"
            )


def _free_colors(plan: Plan) -> tuple[tuple[float, float, float], ...]:
    """Return the colours (linear RGB) of the palette that no channel of the input has."""
    taken = {channel.color for channel in plan.channels}
    return tuple(color for color in PALETTE if color not in taken) or PALETTE
