"""The functions of `import stereocell`: build a source, and open a volume. Imports are lazy."""

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
    """The results of a build: paths, or addresses if OUT is an address.

    out     the folder of the build
    stage   the USD stage
    bundle  the viewer's page
    report  the report's page
    """

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
    """Build the stage, bundle and report of a source in OUT, like the command `stereocell build`.

    source     a path, or an address (http(s)://, s3://)
    out        a folder, or an s3:// address; finished work in it is not repeated
    preset     cycif, em, lightsheet, mri, ct, ct-bone, pet, vessels, or a TOML file; None chooses
               by the source
    config     a TOML file; its values override the preset's
    settings   sections and keys as in the TOML file; they override preset and config
    workers    number of processes; 0 for only this one. A script that starts more needs
               `if __name__ == "__main__":`
    scheduler  address or scheduler file of a Dask cluster, used instead of `workers`
    force      replace anything in OUT; without it, only a build of the same source is replaced

    Progress goes to stderr. Returns the paths of the results. Raises StereoCellError; its text is
    one line, or one line for each reason if tasks fail.

    >>> import json, tempfile, numpy as np, tifffile
    >>> z, y, x = np.ogrid[-16:16:2, -16:16, -16:16]  # um
    >>> ball = 1000 / (1 + np.exp(np.sqrt(z**2 + y**2 + x**2) - 10))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     tifffile.imwrite(source := f"{folder}/ball.tif", ball.astype(np.uint16))
    ...     built = build(source, f"{folder}/out", settings={"plan": {"spacing_um": [2, 1, 1]}})
    ...     manifest = json.loads(Path(built.bundle).with_name("manifest.json").read_text("utf-8"))
    >>> [(channel["surface"], 400 < channel["iso_value"] < 600) for channel in manifest["channels"]]
    [('clear', True)]
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
        ("preset", preset, (str, NoneType), "a preset's name or a TOML file"),
        ("config", config, (*path, NoneType), "a TOML file"),
        ("scheduler", scheduler, (str,), "an address or the name of a file"),
    )
    for name, value, types, expected in kinds:
        if not isinstance(value, types):
            raise UsageError(f"{name} is {value!r:.60}, expected {expected}")
    if not isinstance(settings, Mapping | None):
        raise UsageError(
            f"settings is {settings!r:.60}, expected sections with keys, such as "
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
        report_phase.run_report(folder, engine)
    parts = ("stage/stage.usda", "bundle/index.html", "report/index.html")
    return Built(shown, *(f"{shown}/{part}" for part in parts))


def open_volume(source: str | Path, **options: Any) -> "Dataset":
    """Open a source without reading voxels.

    options  `time`, `spacing_um`, `series`, `pattern`, `axes`, `dark`; `stereocell.read.open`
             describes them, and lists the errors

    The dataset has `channels`, `levels` (shape in voxels and spacing in um, both (z, y, x)) and a
    method `read(channel, box, level)`. It returns a Volume with `voxels` (z, y, x) in the source's
    dtype, `spacing_um` and `origin_um`, both (z, y, x).

    >>> import tempfile, numpy as np, tifffile
    >>> stack = np.arange(8 * 16 * 16, dtype=np.uint16).reshape(8, 16, 16)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     tifffile.imwrite(f"{folder}/stack.tif", stack)
    ...     dataset = open_volume(f"{folder}/stack.tif", spacing_um=(2, 1, 1))
    ...     volume = dataset.read(0, dataset.levels[0].box, level=0)
    >>> volume.voxels.shape, volume.spacing_um, bool((volume.voxels == stack).all())
    ((8, 16, 16), (2.0, 1.0, 1.0), True)
    """
    from stereocell import read
    from stereocell.planning.setting_names import named_as_settings
    from stereocell.read.addresses.resolve import resolve

    with named_as_settings(has_sections=False):
        return read.open(resolve(source).source, **options)
