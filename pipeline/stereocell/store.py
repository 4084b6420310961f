"""OUT: where everything lies, and how results are written and found again.

Results are named by a hash of all that they depend on (input, settings of the step, its code), are
written under a temporary name and renamed: a killed run resumes, a finished one is a no-op.
"""

import hashlib
import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any
from zipfile import BadZipFile

import jsonschema
import numpy as np

from stereocell.assets import find_asset
from stereocell.errors import OutputError
from stereocell.mesh import Lod, Mesh
from stereocell.plan import Plan, from_json, to_json
from stereocell.unit import Unit
from stereocell.write.atomic import replacing_folder, write_bytes


def key_of(content: Any, *modules: ModuleType) -> str:
    """Return the name of a result: a hash of what it depends on and of the code that makes it.

    A package counts with all the modules that lie in its folder.
    """
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode())
    for module in modules:
        assert module.__file__ is not None
        file = Path(module.__file__)
        files = sorted(file.parent.glob("*.py")) if file.name == "__init__.py" else [file]
        for part in files:
            digest.update(part.read_bytes())
    return digest.hexdigest()[:20]


def write_json(path: Path, content: Any) -> None:
    """Put `content` at `path` as JSON, whole or not at all."""
    write_bytes(path, (json.dumps(content, indent=1, allow_nan=False) + "\n").encode())


def read_json(path: Path, remedy: str) -> Any:
    """Return the JSON at `path`. Raises OutputError that names the remedy if it isn't there."""
    try:
        return json.loads(path.read_text())
    except FileNotFoundError:
        raise OutputError(f"{path} is missing: {remedy}") from None
    except (OSError, ValueError) as error:
        raise OutputError(f"{path}: not readable as JSON ({error}): {remedy}") from None


class Store:
    """One OUT folder."""

    def __init__(self, out: Path) -> None:
        self.out = out
        self.plan_file = out / "plan.json"
        self.settings_file = out / "stereocell.toml"
        self.survey_file = out / "units" / "survey.json"
        self.index_file = out / "units" / "done.json"
        self.units_plan_file = out / "units" / "plan.key"
        self.phases_file = out / "phases.json"
        self.stage_dir = out / "stage"
        self.stage_file = self.stage_dir / "stage.usda"
        self.bundle_dir = out / "bundle"
        self.report_file = out / "report" / "index.html"

    def require_writable(self) -> None:
        """Make OUT. Raises OutputError if it can't be made or written."""
        try:
            self.out.mkdir(parents=True, exist_ok=True)
            probe = self.out / f".writable.{os.getpid()}"
            probe.write_bytes(b"")
            probe.unlink()
        except OSError as error:
            raise OutputError(
                f"{self.out}: can't be written ({error.strerror}), expected a folder of your own"
            ) from None

    def save_plan(self, plan: Plan) -> bool:
        """Write plan.json; return whether it changed.

        Raises OutputError if OUT holds a build of another input.
        """
        if self.plan_file.exists():
            there = self.plan()
            if there.fingerprint != plan.fingerprint:
                raise OutputError(
                    f"{self.out} holds a build of {there.name!r} (fingerprint "
                    f"{there.fingerprint[:12]}), not of {plan.name!r} ({plan.fingerprint[:12]}): "
                    "choose another OUT or remove that folder"
                )
            if there == plan:
                return False
        content = to_json(plan)
        _validate(content, self.plan_file)
        write_json(self.plan_file, content)
        return True

    def plan(self) -> Plan:
        """Return the plan. Raises OutputError if there is none or it breaks its schema."""
        content = read_json(self.plan_file, "run `stereocell plan INPUT -o OUT` first")
        _validate(content, self.plan_file)
        return from_json(content)

    # --- results of the units' two rounds

    def iso_file(self, tile_id: str, channel_id: str, key: str) -> Path:
        return self.out / "units" / tile_id / channel_id / f"iso-{key}.json"

    def unit_dir(self, tile_id: str, channel_id: str, key: str) -> Path:
        return self.out / "units" / tile_id / channel_id / key

    def survey(self) -> dict[str, Any]:
        content = read_json(self.survey_file, "run `stereocell units OUT` first")
        return dict(content)

    def index(self) -> dict[str, str]:
        """Return the key of each finished unit, by `<tile>/<channel>`."""
        content = read_json(self.index_file, "run `stereocell units OUT` first")
        return dict(content)

    def sign_units(self, plan: Plan) -> None:
        """Keep which plan the units were built for."""
        self.write_text(self.units_plan_file, key_of(to_json(plan)))

    def require_units_of(self, plan: Plan) -> None:
        """Raise OutputError if the units are of another plan, or of none."""
        there = self.units_plan_file.read_text() if self.units_plan_file.is_file() else ""
        if there != key_of(to_json(plan)):
            raise OutputError(
                f"{self.out / 'units'}: not built for the plan in {self.plan_file.name}: "
                "run `stereocell units OUT` first"
            )

    def record(self, tile_id: str, channel_id: str, key: str) -> dict[str, Any]:
        """Return a unit's record: triangles, distances, seconds, reason."""
        path = self.unit_dir(tile_id, channel_id, key) / "unit.json"
        return dict(read_json(path, "run `stereocell units OUT` again"))

    def write_text(self, path: Path, text: str) -> None:
        write_bytes(path, text.encode())

    def remove_other_folders(self, parent: Path, keep: set[str]) -> None:
        """Remove the folders in `parent` that an earlier plan left."""
        for folder in parent.iterdir():
            if folder.is_dir() and folder.name not in keep:
                shutil.rmtree(folder)

    def phases(self) -> dict[str, dict[str, Any]]:
        """Return what is known of each phase: `key` of what it was made from, `seconds`."""
        try:
            return dict(json.loads(self.phases_file.read_text()))
        except (FileNotFoundError, ValueError):  # none yet, or damaged: nothing counts as done
            return {}

    def times(self) -> dict[str, float]:
        """Return the seconds of each finished phase."""
        return {name: entry["seconds"] for name, entry in self.phases().items() if entry["key"]}

    def phase(self, name: str) -> dict[str, Any]:
        return self.phases().get(name, {})

    def save_phase(self, name: str, key: str, seconds: float) -> None:
        entry = {"key": key, "seconds": round(seconds, 2)}
        write_json(self.phases_file, {**self.phases(), name: entry})


def save_unit(directory: Path, unit: Unit) -> dict[str, Any]:
    """Write a unit as a folder under its final name, and return its record."""
    lods = [
        {
            "triangles": len(lod.mesh.triangles),
            "vertices": len(lod.mesh.positions),
            "distance_um": lod.distance_um,
            "normal_map": 0 if lod.normal_map is None else len(lod.normal_map),
        }
        for lod in unit.lods
    ]
    record = {
        "reason": unit.reason,
        "lods": lods,
        "volume": list(unit.volume.shape),
        "fragments_dropped": unit.fragments_dropped,
        "cavities_filled": unit.cavities_filled,
        "seconds": {step: round(s, 3) for step, s in unit.seconds.items()},
    }
    with replacing_folder(directory) as folder:
        np.save(folder / "volume.npy", unit.volume)
        for level, lod in enumerate(unit.lods):
            np.savez(lod_file(folder, level), **_arrays(lod))
        write_json(folder / "unit.json", record)
    return record


def is_whole(directory: Path) -> bool:
    """Return whether a unit's folder holds all that its record names."""
    try:
        record = json.loads((directory / "unit.json").read_text())
        files = [directory / "volume.npy"]
        files += [lod_file(directory, level) for level in range(len(record["lods"]))]
    except (OSError, ValueError, LookupError):
        return False
    return all(file.is_file() for file in files)


def lod_file(directory: Path, level: int) -> Path:
    """Return where `save_unit` puts one level of detail."""
    return directory / f"lod{level}.npz"


def load_lods(directory: Path) -> tuple[Lod, ...]:
    """Return the levels of detail that `save_unit` wrote.

    Raises OutputError for a damaged file, naming the folder to remove.
    """
    try:
        record = json.loads((directory / "unit.json").read_text())
        return tuple(_load_lod(directory, k, lod) for k, lod in enumerate(record["lods"]))
    except (OSError, ValueError, LookupError, BadZipFile) as error:
        raise OutputError(
            f"{directory}: damaged ({error}): remove it and run `stereocell units OUT`"
        ) from error


def _load_lod(directory: Path, level: int, stored: Mapping[str, Any]) -> Lod:
    # opened here: numpy leaves a damaged file open
    with lod_file(directory, level).open("rb") as file, np.load(file) as arrays:
        mesh = Mesh(
            arrays["positions"],
            arrays["triangles"],
            arrays["normals"],
            arrays.get("uvs"),
            arrays.get("tangents"),
        )
        return Lod(mesh, stored["distance_um"], arrays.get("normal_map"))


def _arrays(lod: Lod) -> dict[str, Any]:
    arrays = {
        "positions": lod.mesh.positions,
        "triangles": lod.mesh.triangles,
        "normals": lod.mesh.normals,
        "uvs": lod.mesh.uvs,
        "tangents": lod.mesh.tangents,
        "normal_map": lod.normal_map,
    }
    return {name: array for name, array in arrays.items() if array is not None}


def _validate(content: Mapping[str, Any], path: Path) -> None:
    schema = json.loads(find_asset("schemas/plan.schema.json").read_text())
    error = jsonschema.exceptions.best_match(
        jsonschema.Draft202012Validator(schema).iter_errors(content)
    )
    if error is not None:
        field = ".".join(str(part) for part in error.absolute_path) or "the file"
        raise OutputError(f"{path}: {field}: {error.message}")
