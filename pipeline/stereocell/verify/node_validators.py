"""Run the validators of glTF and KTX2, which are Node packages, on a bundle's files.

If Node or a package is missing, the check fails and names the remedy.
"""

import json
import shutil
import subprocess
from pathlib import Path

from stereocell.model.errors import CheckError
from stereocell.storage.assets import find_asset
from stereocell.verify.bundle_documents import channels_of
from stereocell.verify.check_line import raise_on

_NODE_TIMEOUT_S = 1200.0  # s, longest time of one script for all files


def check_meshes(bundle: Path) -> str:
    """Check every .glb of a bundle by the validator of glTF."""
    paths = sorted(bundle.rglob("*.glb"))
    if not paths and all(channel["tileset"] is None for channel in channels_of(bundle)):
        return "0 files: no channel has a surface"
    return _run_node("check_glb.mjs", paths)


def check_textures(bundle: Path) -> str:
    """Check every KTX2 texture of a bundle, in its own file or inside a .glb."""
    return _run_node("check_ktx2.mjs", sorted([*bundle.rglob("*.ktx2"), *bundle.rglob("*.glb")]))


def _run_node(script_name: str, paths: list[Path]) -> str:
    """Run one script of viewer_gltf/tools on all files; return the number of files in words.

    Raises CheckError if the script can't run, or finds a problem.
    """
    if not paths:
        raise CheckError("found no file to check, expected some in the bundle")
    try:
        script = find_asset(f"viewer_gltf/tools/{script_name}")
    except FileNotFoundError as error:
        raise CheckError(
            f"{script_name}: missing, because only a checkout of StereoCell has it: check there"
        ) from error
    node = shutil.which("node")
    if node is None:
        raise CheckError(f"found no `node` to run {script_name}: install Node 20.19 or newer")
    try:
        answer = subprocess.run(
            [node, str(script)],
            input=json.dumps([str(path) for path in paths]),
            capture_output=True,
            encoding="utf-8",
            timeout=_NODE_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise CheckError(f"{script_name} did not finish in {_NODE_TIMEOUT_S:g} s") from error
    if "ERR_MODULE_NOT_FOUND" in answer.stderr:
        raise CheckError(f"{script.parent.parent}: its node packages are missing: run `make setup`")
    if answer.returncode != 0:
        raise CheckError(f"{script_name} failed: {' '.join(answer.stderr.split())[-300:]}")
    results = json.loads(answer.stdout)
    raise_on([f"{result['path']}: {p}" for result in results for p in result["problems"]])
    return f"{len(results)} files"
