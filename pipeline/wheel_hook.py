"""A hook of hatchling that adds the built viewer to wheels and sdists, or stops if it is missing.

A wheel contains the viewer, so that users need no Node to view a build. It also contains the two
scripts of `stereocell check` and the packages that they import, so that these need only Node. An
sdist has the same files at the places of a checkout, so that anybody can make a wheel from it. An
editable install finds the files in the checkout, and needs no viewer that is already built.
"""

import json
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# Packages that viewer_gltf/tools/*.mjs import.
TOOL_PACKAGES = ("gltf-validator", "ktx-parse", "meshoptimizer", "zstddec")


class WheelHook(BuildHookInterface[Any]):
    """Adds parts of viewer_gltf/. In a wheel they lie where `stereocell.storage.assets` looks."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if version == "editable":
            return
        viewer = Path(self.root) / "viewer_gltf"
        packages = viewer / "node_modules"
        parts = [viewer / "dist", viewer / "tools", *(packages / name for name in TOOL_PACKAGES)]
        missing = [part for part in (viewer / "dist/index.html", *parts) if not part.exists()]
        if missing:
            self.app.abort(
                f"{self.target_name}: {missing[0].relative_to(self.root)} is missing, expected the "
                "built viewer. Run `make wheel`, which builds it first (Node 20.19 or newer)."
            )
        # The viewer contains these packages, and their licences must be distributed with it.
        used = json.loads((viewer / "package.json").read_bytes())["dependencies"]
        for name in sorted(used.keys() - set(TOOL_PACKAGES)):
            parts += (packages / name).glob("LICENSE*")
        for part in parts:
            inside = part.relative_to(self.root).as_posix()
            to = inside if self.target_name == "sdist" else f"stereocell/{inside}"
            build_data["force_include"][str(part)] = to
