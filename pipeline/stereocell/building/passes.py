"""The passes over the units: first what all of a channel's tiles share, then the units themselves.

The survey finds each channel's window and level, dataset-wide (channel_survey.py). Then meshes and
volumes are built. Every result lies under a name that says what it depends on.
"""

from stereocell.building.channel_survey import survey_channels
from stereocell.building.object_passes import locate_objects, save_notes, tell_objects
from stereocell.building.out_folder import OutFolder
from stereocell.building.run_on_input import run_pass
from stereocell.building.running_pass import remove_mixed
from stereocell.engine.run import Engine
from stereocell.engine.run_steps import Kept
from stereocell.engine.step import Step
from stereocell.model.errors import UsageError
from stereocell.model.unit import Unit
from stereocell.planning.channels import Channel
from stereocell.planning.object_steps import object_steps
from stereocell.planning.plan import Plan
from stereocell.planning.unit_steps import unit_steps
from stereocell.steps.labels import Labels


def run_passes(
    out_folder: OutFolder, plan: Plan, *, engine: Engine, only: str | None
) -> tuple[int, int]:
    """Build the units (or `only` one, `<tile>/<channel>`).

    Returns how many were not done already, and how many others are still to be built.

    Raises SourceError if the source is no longer what was planned, TasksFailedError once all
    others are finished.
    """
    remove_mixed(out_folder, plan)
    wanted = {f"{tile_id}/{channel.id}": channel for tile_id, channel in _select(plan, only)}
    survey = survey_channels(out_folder, plan, engine)
    for labels in plan.labels:
        save_notes(out_folder, plan, labels)
    located = {one.id: locate_objects(out_folder, plan, one, engine) for one in plan.labels}
    steps: dict[str, Step[Unit]] = {
        **unit_steps(plan, survey),
        **object_steps(plan, located, survey),
    }
    missing, others = [], 0
    for name, step in steps.items():
        label = wanted[name].name if name in wanted else ""
        unit = Kept(f"{name.split('/')[0]}/{label}", step, out_folder.unit_dir(name, step.key))
        if unit.is_whole():
            continue
        if name in wanted:
            missing.append(unit)
        else:
            others += 1
    if missing:
        for labels in plan.labels:
            tell_objects(labels, located[labels.id])
    run_pass(out_folder, plan, engine, "units", missing, is_last=True)
    if not others:  # all there: the stage may be made of them
        out_folder.save_units(plan, {name: step.key for name, step in steps.items()})
    return len(missing), others


def _select(plan: Plan, only: str | None) -> list[tuple[str, Channel | Labels]]:
    every: list[Channel | Labels] = [*plan.channels, *plan.labels]
    wanted = [(tile.id, channel) for tile in plan.tiles for channel in every]
    if only is None:
        return wanted
    chosen = [(t, c) for t, c in wanted if only in {f"{t}/{n}" for n in _names(c)}]
    if not chosen:
        raise UsageError(
            f"--only is {only!r}, expected TILE/CHANNEL with a tile from {plan.tiles[0].id} to "
            f"{plan.tiles[-1].id} and a channel of {', '.join(c.name for c in every)}"
        )
    return chosen


def _names(channel: Channel | Labels) -> tuple[str | int, ...]:
    """Return what a channel may be called; an index is one of the input's."""
    if isinstance(channel, Labels):
        return channel.name, channel.id
    return (channel.name, channel.id) + (() if channel.source else (channel.index,))
