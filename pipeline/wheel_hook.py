"""What hatchling asks when it builds a wheel or an sdist: the built viewer goes in, or neither is.

A wheel has the viewer, so that viewing takes no Node, and the two scripts of `stereocell check`
with the packages that they import, so that they take Node alone. An sdist has them where a checkout
has, so that a wheel can be made of it anywhere. An editable install finds both in the checkout,
built or not.
"""

import json
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# What viewer_gltf/tools/*.mjs import
TOOL_PACKAGES = ("gltf-validator", "ktx-parse", "meshoptimizer", "zstddec")


class WheelHook(BuildHookInterface[Any]):
    """Adds parts of viewer_gltf/: to a wheel where `stereocell.storage.assets` looks for them."""

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
                "built viewer: run `make wheel`, which builds it first (Node 20.19 or newer)"
            )
        # the viewer is made of these, and their licences ask to be passed on
        used = json.loads((viewer / "package.json").read_bytes())["dependencies"]
        for name in sorted(used.keys() - set(TOOL_PACKAGES)):
            parts += (packages / name).glob("LICENSE*")
        for part in parts:
            inside = part.relative_to(self.root).as_posix()
            to = inside if self.target_name == "sdist" else f"stereocell/{inside}"
            build_data["force_include"][str(part)] = to
