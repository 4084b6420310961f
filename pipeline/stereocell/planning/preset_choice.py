"""Choose the preset that suits a source if the user names none."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from stereocell.engine.run import console
from stereocell.model.errors import StereoCellError
from stereocell.model.modality import TRACER_MODALITIES
from stereocell.planning.channels import ALL
from stereocell.planning.ct_evidence import (
    LEVELS_HU,
    NO_SCALE,
    CtEvidence,
    find_ct_evidence,
    is_other_scale,
)
from stereocell.planning.earlier_names import (
    COMMAND_LINE,
    print_earlier_names,
    with_present_names,
)
from stereocell.planning.input_files import as_asked
from stereocell.planning.setting_names import flagged_settings, in_flags
from stereocell.planning.settings import HOUNSFIELD, NO_PRESET, Settings, load
from stereocell.planning.tracer_name import tracer_word
from stereocell.read import Dataset
from stereocell.read.addresses.resolve import resolve
from stereocell.steps.open_source import open_source

_BY_MODALITY = {"MR": "mri", "CT": "ct", **dict.fromkeys(TRACER_MODALITIES, "pet")}
_BODY_UM = 100.0  # um; least voxel spacing of a body's scan. Finer voxels come from a microscope.
# um, um: voxel spacings above the first and up to the second come from light sheets and confocal
# overviews of thick tissue. There cells are a few voxels wide, and tissue fills the field of view.
_OVERVIEW_UM = (1.0, 10.0)
_PATIENT_UM = (
    300.0  # um; least voxel spacing of a patient's MR, micro-CT and animals have finer ones
)
_AS_HEAT = "for a PET or SPECT --preset pet, which shows heat"
_PART_UM = 20_000.0  # um; in smaller volumes, presets of patients would drop half of the specimen


def load_for(
    source: str | Path,
    preset: str | None,
    config: Path | None,
    *,
    flags: Mapping[str, Any],
    where: str = COMMAND_LINE,
) -> tuple[Settings, tuple[str, ...]]:
    """Return the settings of a build, and notes for the plan.

    If neither a preset nor a file of settings (`config`) is given, the preset that suits the source
    is used. The notes state that choice and its reason, or why a named preset of CT does not fit
    the voxels. An unreadable source raises no error here, because the next step reports it.

    The arguments are those of `settings.load`.
    """
    flags, lines = with_present_names(flags, where)
    names = [flag.name for flag, _, _ in flagged_settings()] if where == COMMAND_LINE else []
    print_earlier_names([in_flags(line, names) for line in lines])
    if preset is not None or config is not None:
        settings = load(preset, config, flags=flags, where=where)
        has_level = set(settings.iso_values) - {ALL} or settings.surfaces
        is_checked = preset in LEVELS_HU and config is None and not has_level
        return settings, _notes_on_mismatch(source, preset or "", settings) if is_checked else ()
    settings = load(None, None, flags=flags, where=where)
    options = settings.plan
    try:
        location = resolve(source).source
        dataset = open_source(as_asked(location, options))
        if (
            options.taken_as == HOUNSFIELD
            and (dataset.modality or options.modality or "CT") == "CT"
        ):
            text = f"the values are taken for Hounsfield units (--as {HOUNSFIELD})"
            return load("ct", None, flags=flags, where=where), _describe("ct", text)
        word = tracer_word(location)
        chosen, notes = choose_preset(dataset, modality=options.modality, tracer=word)
    except StereoCellError:
        return settings, ()
    return (load(chosen, None, flags=flags, where=where) if chosen else settings), notes


def _notes_on_mismatch(source: str | Path, preset: str, settings: Settings) -> tuple[str, ...]:
    """Return the note on a preset of CT that the user names but that does not fit the voxels."""
    try:
        if settings.plan.taken_as == HOUNSFIELD:
            return ()
        dataset = open_source(as_asked(resolve(source).source, settings.plan))
        if dataset.modality and dataset.dtype.kind != "u":  # a source that states this is trusted
            return ()
        mismatch = _explain_mismatch(dataset, preset)
    except StereoCellError:
        return ()
    return (f"preset {preset}: {mismatch}",) if mismatch else ()


def _explain_mismatch(dataset: Dataset, preset: str) -> str:
    """Return why a level in Hounsfield units does not fit the voxels; empty: it may fit.

    If a reader knows that the values are not Hounsfield units, it has noted so already.
    """
    if not dataset.has_hounsfield_units:
        return ""
    evidence = find_ct_evidence(dataset)
    if not evidence.has_no_air:
        return ""
    flags, level = evidence.flags, LEVELS_HU[preset]
    if preset == "ct-bone":
        flags = evidence.bone_flags or "--iso-value 0=VALUE sets an iso-value"
    mismatch = f"{evidence.words}, and its iso-value of {level:g} is meant for Hounsfield units"
    if is_other_scale(dataset, level):
        return (
            f"{mismatch}: its iso-value and window are ignored, and the build finds others (or "
            f"{flags})"
        )
    return f"{mismatch} ({flags})"


def print_choice(choice: Sequence[str]) -> None:
    """Print the notes on the choice of a preset, once the source has been opened without error."""
    for note in choice:
        console.print(f"plan: {note}", markup=False)


def choose_preset(
    dataset: Dataset, *, modality: str = "", tracer: str = ""
) -> tuple[str | None, tuple[str, ...]]:
    """Return the name of a preset, or None for the defaults, and sentences on the reasons.

    modality  modality in the settings; it counts if the input states none
    tracer    word in the source's name that states PET or SPECT; empty: there is none
    """
    known = dataset.modality or modality
    level = dataset.levels[0]
    finest = min(level.spacing_um)
    if not known and finest < _BODY_UM:
        return _of_microscope(finest)
    across = max(n * h for n, h in zip(level.shape, level.spacing_um, strict=True))
    if across < _PART_UM:
        return None, _describe(None, f"{across / 1000:.3g} mm across, too small for a patient")
    if not dataset.has_hounsfield_units:
        chosen = _BY_MODALITY["CT"]
        return chosen, _describe(chosen, "the input is a CT, but not in Hounsfield units")
    if known:
        by_kind = _BY_MODALITY.get(known)
        is_unsigned_ct = by_kind == "ct" and dataset.dtype.kind == "u"
        mismatch = _explain_mismatch(dataset, "ct") if is_unsigned_ct else ""
        reasons = _describe(by_kind, f"the input is {known}")
        return by_kind, (*reasons, f"preset {by_kind}: {mismatch}") if mismatch else reasons
    return _by_values(find_ct_evidence(dataset), finest, tracer)


def _of_microscope(finest_um: float) -> tuple[str | None, tuple[str, ...]]:
    """Return the preset for a microscope's volume, and the reasons."""
    over, up_to = _OVERVIEW_UM
    voxels = f"voxels of {finest_um:.3g} um, as of a"
    if over < finest_um <= up_to:
        return "lightsheet", _describe(
            "lightsheet", f"{voxels} light sheet in tissue: cells are looked for"
        )
    return None, _describe(None, f"{voxels} microscope")


def _by_values(
    evidence: CtEvidence, finest_um: float, tracer: str
) -> tuple[str | None, tuple[str, ...]]:
    """Return the preset for a body whose modality is not stated, and the reasons.

    tracer  word in the source's name that states PET or SPECT; empty: there is none
    """
    size = f"voxels of {finest_um / 1000:.3g} mm"
    if evidence.is_hounsfield:
        return "ct", _describe("ct", f"{size} and {evidence.words}")
    if tracer:
        text = f"{size}, and {tracer!r} in the source's name: PET is assumed, as heat"
        return "pet", _describe("pet", text)
    known = f"{size}, {evidence.words}" if evidence.basis else size
    if finest_um < _PATIENT_UM:
        text = f"{known}, and no modality is stated: finer than an MR of a patient"
        return None, (*_describe(None, text), _advice(evidence))
    assumed = f"{known}, and no modality is stated: MR is assumed"
    return "mri", (*_describe("mri", assumed), f"{_advice(evidence)}; {_AS_HEAT}")


def _advice(evidence: CtEvidence) -> str:
    """Return the flags that build the volume as a CT instead, and how their level was found."""
    if not evidence.basis:
        return f"{evidence.words} are typical of a CT: for a CT {evidence.flags}"
    if evidence.basis == NO_SCALE:
        return f"for a CT {evidence.flags}"
    return f"for a CT {evidence.flags}; its iso-value lies {evidence.basis}"


def _describe(chosen: str | None, reason: str) -> tuple[str, ...]:
    if chosen is None:
        return (f"no preset: {reason}: lengths follow the voxel spacing (--preset names one)",)
    return (f"preset {chosen}: {reason} (or --preset {NO_PRESET} for the defaults)",)
