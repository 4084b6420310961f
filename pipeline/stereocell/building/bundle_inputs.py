"""Find the inputs of a bundle: the composed stage in OUT, or one that an artist has edited."""

from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.building.phase import states_of
from stereocell.bundle.manifest import MANIFEST
from stereocell.steps.write_bundle import WriteBundle
from stereocell.textures.map_packages import encoder_version
from stereocell.usd import written_files
from stereocell.usd.stage_files import dependencies, may_be_image
from stereocell.usd.write_previews import PREVIEWS


def require_kept_stage(out_folder: OutFolder) -> None:
    """Raise StageError if a file that the stage's phase wrote is missing or damaged.

    A layer that may have been edited in place is accepted. The bundle's writer reports it.
    """
    if out_folder.has_begun("stage"):  # otherwise this build did not write the stage
        listed = written_files.read_stage_list(out_folder.stage_dir)
        written_files.require_kept(out_folder.stage_dir, listed, out_folder.stage_list)


def bundle_step(out_folder: OutFolder, path: Path, viewer: Path | None) -> WriteBundle:
    """Return the step that writes the bundle. Raises StageError for foreign files.

    path    file of the stage
    viewer  folder of the viewer's page; None: it is not built
    """
    kept = out_folder.marks(path.parent)
    files = dependencies(path, out_folder.stage_dir)  # called first, since it refuses foreign files
    made_of = (str(path.absolute()), *states_of(files)) if kept is None else tuple(kept)
    # The encoder's version counts only if there are images that a surface may use.
    previews = out_folder.stage_dir / PREVIEWS  # no surface uses these images
    images = [file for file in files if may_be_image(file) and file.parent != previews]
    encoder = encoder_version() if images else None
    page = () if viewer is None else tuple(states_of(sorted(viewer.rglob("*"))))
    return WriteBundle(made_of, page, encoder)


def remove_half_bundle(out_folder: OutFolder) -> None:
    """Remove a bundle without a manifest, which is stored last: its command was killed before."""
    is_half = out_folder.is_stored and out_folder.is_begun("bundle")
    if is_half and not out_folder.has(out_folder.bundle_dir / MANIFEST):
        out_folder.remove(out_folder.bundle_dir)
