"""Find the stage that a bundle is made from, before USD is imported, which is slow."""

from pathlib import Path

from stereocell.building.out_folder import OutFolder
from stereocell.building.own_parts import no_layer
from stereocell.textures.map_packages import require_map_packages


def require_stage(out_folder: OutFolder, layer: Path | None) -> Path:
    """Return the path of the stage to export.

    layer  layer named by --stage; None: OUT's own stage

    Raises OutputError if the stage is missing or unfinished.
    """
    out_folder.require_finished("stage")
    if out_folder.has(out_folder.plan_file):
        plan = out_folder.plan()  # raises an error if the plan was changed by hand
        if plan.settings.unwrap.maps:
            require_map_packages()
    path = layer if layer is not None else out_folder.stage_file
    if not out_folder.has(path):
        raise no_layer(path, is_given=layer is not None)
    return path
