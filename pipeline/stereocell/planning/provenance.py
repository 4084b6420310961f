"""Collect the provenance of results: settings and versions, but no paths and no identities."""

from typing import Any

from stereocell.engine.step_record import libraries_of
from stereocell.model.extra_packages import version_of
from stereocell.model.version import GENERATOR
from stereocell.planning.plan import Plan
from stereocell.planning.settings import to_dict
from stereocell.read.known_formats import format_of
from stereocell.textures.map_packages import (
    UNWRAPPER,
)

# Steps whose libraries are named in the provenance of a stage. They are not imported, because a
# plan would then import the libraries of all steps.
STEPS = ("FindWindow", "GatherEvidence", "SumComponents", "BuildUnit", "WriteStageTile")


def provenance(plan: Plan) -> dict[str, Any]:
    """Return the provenance for results: settings and versions, but no paths and no identities."""
    settings = _without_places(to_dict(plan.settings))
    # The plan's formats are used, because the sources may be gone when a stage is written. The
    # source of an added channel lies in OUT.
    formats = {*plan.formats, *(format_of(c.source).name for c in plan.channels if c.source)}
    return {
        "generator": GENERATOR,
        "fingerprint": plan.fingerprint,
        "level": plan.level,
        "spacing_um": list(plan.spacing_um),
        "settings": settings,
        "libraries": {
            **libraries_of(*STEPS, *sorted(formats)),
            **({UNWRAPPER: version_of(UNWRAPPER)} if plan.settings.unwrap.maps else {}),
        },
        **_added(plan),
    }


def provenance_record(plan: Plan) -> dict[str, Any]:
    """Return the content of provenance.json: the provenance, and the notes on reading the source.

    Results leave the notes out, because some name the source's files.
    """
    return {**provenance(plan), "notes": list(plan.notes)}


def _without_places(settings: dict[str, Any]) -> dict[str, Any]:
    """Return settings without the paths in them, which may name a patient or a person."""
    labels = dict.fromkeys(settings["labels"], "")
    objects = {**settings["objects"], "table": "table" if settings["objects"]["table"] else ""}
    return {**settings, "labels": labels, "objects": objects}


def _added(plan: Plan) -> dict[str, Any]:
    """Return the fingerprints of sources that belong to one channel alone, by channel name."""
    added = {c.name: c.fingerprint for c in plan.channels if c.source}
    return {"added_channels": added} if added else {}
