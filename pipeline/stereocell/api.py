"""The functions of `import stereocell`: a whole build from Python. Imports are lazy."""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any

from stereocell.model.errors import UsageError

if TYPE_CHECKING:
    from stereocell.read import Dataset


@dataclass(frozen=True, slots=True)
class Built:
    """The results of a build: paths, or addresses where OUT is one."""

    out: str
    stage: str
    bundle: str
    report: str


def build(
    source: str | Path,
    out: str | Path,
    *,
    preset: str | None = None,
    config: str | Path | None = None,
    settings: Mapping[str, Any] | None = None,
    workers: int = 0,
    scheduler: str = "",
    force: bool = False,
) -> Built:
    """Build stage, bundle and report of a source in OUT, as the command `stereocell build` does.

    source     a path, or an address (http(s)://, s3://)
    out        a folder, or an s3:// address; finished work there is not repeated
    preset     cycif, em, lightsheet, mri, ct, ct-bone, pet, vessels, or a TOML file
    config     a TOML file; its values override the preset's
    settings   sections and keys that override both, as in the TOML
    workers    processes; 0: this one. A script with more needs `if __name__ == "__main__":`
    scheduler  address or scheduler file of a Dask cluster, used instead of `workers`
    force      replace all that lies in OUT; otherwise only a build of the same source is replaced

    Progress goes to stderr. Raises StereoCellError, whose text is one line (a line for each
    reason where tasks fail).

        built = build("scan.ome.zarr", "out/scan", preset="cycif", settings={"plan": {"level": 1}})
    """
    from stereocell.building import phases
    from stereocell.building.out_folder import require_build_or_nothing
    from stereocell.engine.run import Engine
    from stereocell.engine.worker_pool import leave_if_importing_main
    from stereocell.planning.preset_choice import load_for
    from stereocell.planning.setting_names import named_as_settings
    from stereocell.read.source_place import require_apart
    from stereocell.report import phase as report_phase
    from stereocell.storage.claim import LOCK
    from stereocell.storage.location import Location
    from stereocell.storage.lock import alone_in
    from stereocell.storage.overwriting import IN_PYTHON, forcing
    from stereocell.storage.shell_commands import as_shown, filling_in
    from stereocell.storage.workspace import opened

    leave_if_importing_main()
    if not isinstance(workers, int) or workers < 0:
        raise UsageError(f"workers is {workers!r}, expected a whole number, 0 or more")
    path = (str, Path)
    kinds: tuple[tuple[str, Any, tuple[type, ...], str], ...] = (
        ("source", source, path, "a path or an address"),
        ("out", out, path, "a path or an address"),
        ("preset", preset, (str, NoneType), "a name or a TOML file's"),
        ("config", config, (*path, NoneType), "a TOML file"),
        ("scheduler", scheduler, (str,), "an address or a file's name"),
    )
    for name, value, types, expected in kinds:
        if not isinstance(value, types):
            raise UsageError(f"{name} is {value!r:.60}, expected {expected}")
    if not isinstance(settings, Mapping | None):
        raise UsageError(
            f"settings are {settings!r:.60}, expected sections and keys, as "
            "{'plan': {'level': 1}}"
        )
    file = None if config is None else Path(config)
    place = Location.of(out)
    shown = place.source if place.is_local else place.shown.rstrip("/")
    with ExitStack() as stack:
        stack.enter_context(filling_in({"OUT": shown, "INPUT": as_shown(str(source))}))
        stack.enter_context(named_as_settings())
        stack.enter_context(forcing(force, IN_PYTHON))
        if place.is_local:
            folder = Path(place.source)
            require_apart(source, folder)
            require_build_or_nothing(folder, source)
            stack.enter_context(alone_in(folder, "build"))
        else:
            folder = stack.enter_context(opened(place.source, command="build"))
            require_build_or_nothing(folder, source)
        wanted, choice = load_for(source, preset, file, flags=settings or {}, where="settings")
        engine = Engine(workers, scheduler, folder / LOCK if place.is_local else None)
        stack.callback(engine.close)
        phases.make_plan(str(source), folder, wanted, choice=choice, engine=engine)
        phases.run_units(folder, engine)
        phases.run_stage(folder, engine)
        phases.run_bundle(folder, engine)
        report_phase.run_report(folder)
    parts = ("stage/stage.usda", "bundle/index.html", "report/index.html")
    return Built(shown, *(f"{shown}/{part}" for part in parts))


def open_volume(source: str | Path, **options: Any) -> "Dataset":
    """Open a source without reading voxels.

    options  `time`, `spacing_um`, `series`, `pattern`, `axes`, `dark`: see `stereocell.read.open`,
             with the errors

    The dataset has `channels`, `levels` (shape in voxels and spacing in um, (z, y, x)) and
    `read(channel, box, level)`. That returns a Volume: `voxels` (z, y, x) in the source's dtype,
    `spacing_um` and `origin_um`, both (z, y, x).

        dataset = open_volume("head.nii.gz")
        volume = dataset.read(0, dataset.levels[-1].box, level=len(dataset.levels) - 1)
    """
    from stereocell import read
    from stereocell.planning.setting_names import named_as_settings
    from stereocell.read.addresses.resolve import resolve

    with named_as_settings(has_sections=False):
        return read.open(resolve(source).source, **options)
