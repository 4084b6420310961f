"""The bundle as a phase of a build: it is exported anew where the composed stage has changed."""

from functools import partial
from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.building.own_parts import no_layer, require_own_bundle
from stereocell.building.phase import Phase, digest_of_bundle, phase_of, states_of
from stereocell.bundle import write as bundle_writer
from stereocell.bundle.manifest import require_bundle
from stereocell.engine.run import Engine, console
from stereocell.read.image import printable
from stereocell.steps.write_bundle import WriteBundle
from stereocell.storage.assets import viewer_dist
from stereocell.storage.overwriting import is_forced
from stereocell.storage.workspace import is_file, objects_below, remove
from stereocell.textures.map_packages import encoder_version, require_map_packages
from stereocell.usd import written_files
from stereocell.usd.stage_files import dependencies, may_be_image


def run_bundle(out: Path, engine: Engine, *, stage: Path | None = None) -> None:
    """Write OUT/bundle from the composed stage: OUT/stage/stage.usda, or a layer over it (`stage`).

    Raises OutputError where the stage is missing, StageError where it can't be read.
    """
    out_folder = OutFolder(out)
    with phase_of(out_folder, "bundle") as phase:
        path = _require_stage(out_folder, stage)
        viewer = viewer_dist()
        step = _step(out_folder, path, viewer)
        _require_kept(out_folder)
        if objects_below(path.parent) is not None and out_folder.is_begun("bundle"):
            bundle_writer.remove_half(out_folder.bundle_dir)
        if not is_forced():
            require_bundle(out_folder.bundle_dir)  # before the phase is begun
        done = partial(digest_of_bundle, out_folder)
        if not phase.is_done(step.key, done, require_own=require_own_bundle):
            out_folder.remove_other_folders(out_folder.parts_dir, {step.key})
            parts = out_folder.parts_dir / step.key
            step.write(out_folder.bundle_dir, path, viewer, parts=parts, run=engine.run)
            phase.about = "" if stage is None else f"of {printable(path.name)}"
    remove(out_folder.parts_dir)
    _tell_of_page(phase, viewer)


def _require_stage(out_folder: OutFolder, layer: Path | None) -> Path:
    """Return the path of the stage to export. Raises OutputError where that can't be begun."""
    out_folder.require_finished("stage")
    if is_file(out_folder.plan_file):
        plan = out_folder.plan()  # no phase goes on beside a plan that was changed by hand
        if plan.settings.unwrap.maps:
            require_map_packages()
    path = layer if layer is not None else out_folder.stage_file
    if not is_file(path):
        raise no_layer(path, is_given=layer is not None)
    return path


def _require_kept(out_folder: OutFolder) -> None:
    """Raise StageError where a file that the stage's phase wrote is lost or damaged.

    A layer that may have been edited in place passes, and the bundle's writer names it.
    """
    if out_folder.has_begun("stage"):  # otherwise this build did not write the stage
        listed = written_files.read_stage_list(out_folder.stage_dir)
        written_files.require_kept(out_folder.stage_dir, listed, out_folder.stage_list)


def _step(out_folder: OutFolder, path: Path, viewer: Path | None) -> WriteBundle:
    """Return the step that writes the bundle. Raises StageError for foreign files.

    path    the stage
    viewer  the folder of the page; None: it is not built
    """
    kept = objects_below(path.parent)
    files = dependencies(path, out_folder.stage_dir)  # first: it refuses foreign files
    made_of = (str(path.absolute()), *states_of(files)) if kept is None else tuple(kept)
    # an image may feed a surface, and is encoded then: by this version, or not at all
    encoder = encoder_version() if any(map(may_be_image, files)) else None
    page = () if viewer is None else tuple(states_of(sorted(viewer.rglob("*"))))
    return WriteBundle(made_of, page, encoder)


def _tell_of_page(phase: Phase, viewer: Path | None) -> None:
    """Say that the bundle has no page, where it was written without one."""
    if viewer is None and not phase.is_up_to_date:
        console.print(
            "bundle: the viewer is not built, so the bundle has no page: run `make setup`"
        )
