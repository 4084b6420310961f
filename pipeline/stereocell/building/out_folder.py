"""OUT: the paths of all results, and the files that list them.

The name of a result is the key of its step, a hash of everything that the result depends on. A
result is written under a temporary name and renamed, so a killed run resumes and a finished one
does nothing.
"""

import json
import re
import secrets
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

from stereocell.engine.step import key_of
from stereocell.model.errors import OutputError, UsageError
from stereocell.planning.plan import Plan
from stereocell.planning.plan_file import from_json, to_json
from stereocell.storage import workspace
from stereocell.storage.contents import contents_of
from stereocell.storage.documents import NOT_WRITTEN, SETTINGS, parse
from stereocell.storage.file_list import sizes_of
from stereocell.storage.json_files import find_sealed, read_json, read_sealed, sealed, write_sealed
from stereocell.storage.kinds import Kind
from stereocell.storage.overwriting import require_free

SURVEY = "units.schema.json#Survey"
PLAN = "plan.schema.json"
PHASES, INDEX = "units.schema.json#Phases", "units.schema.json#Index"
EXPORTS = "units.schema.json#Exports"
PROVENANCE, PLAN_KEY = "units.schema.json#Provenance", "units.schema.json#PlanKey"
_NAMES = {"plan", "units", "stage", "bundle", "report"}  # names of the phases
_UNFINISHED = {"key": "", "results": "", "seconds": 0.0, "about": ""}
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]")
_RUN_UNITS = "run `stereocell units OUT` first"
PHASES_AGAIN = (
    "run `stereocell units OUT && stereocell stage OUT && stereocell bundle OUT && "
    "stereocell report OUT` again"
)


def require_build_or_nothing(out: Path, source: str | Path) -> None:
    """Raise OutputError if OUT holds anything other than a build.

    The source's own file may lie there. Files whose names begin with a dot may as well, because no
    result has such a name.
    """
    found = contents_of(out)
    if found.kind in (Kind.FILE, Kind.SCENE):
        raise OutputError(f"{out}: found {found.words}, expected a folder: choose another OUT")
    beside = {Path(source).name} if Path(source).parent.resolve() == out.resolve() else set()
    others = {name for name in workspace.names_in(out) if not name.startswith(".")} - beside
    if others and found.kind is not Kind.BUILD:
        require_free(out, expected="nothing or a build")


class OutFolder:
    """One OUT folder."""

    def __init__(self, out: Path) -> None:
        self.out = out
        self.plan_file = out / "plan.json"
        self.settings_file = out / SETTINGS
        self.provenance_file = out / "provenance.json"
        self.units_dir = out / "units"
        self.running_file = out / "running.json"
        self.survey_file = self.units_dir / "survey.json"
        self.index_file = out / "units" / "done.json"
        self.units_plan_file = out / "units" / "plan.key"
        self.phases_file = out / "phases.json"
        self.exports_file = out / "exports.json"
        self.stage_dir = out / "stage"
        self.stage_file = self.stage_dir / "stage.usda"
        self.stage_list = self.stage_dir / "files.json"
        self.bundle_dir = out / "bundle"
        self.stage_parts_dir = out / "stage_parts"  # finished parts of tiles of the stage
        self.parts_dir = out / "bundle_parts"  # finished parts of the bundle, until it is complete
        self.report_file = out / "report" / "index.html"

    def require_name(self) -> None:
        """Raise UsageError if OUT's path has a control character, which USD can't read."""
        path = str(self.out.absolute())
        if _CONTROL.search(path):
            raise UsageError(
                f"OUT is {path!r}, expected a path without control characters, which USD can't "
                "read: choose another OUT"
            )

    def require_writable(self) -> None:
        """Create OUT. Raises OutputError where it can't be created or written."""
        try:
            self.out.mkdir(parents=True, exist_ok=True)
            probe = self.out / f".writable.{secrets.token_hex(4)}"
            probe.write_bytes(b"")
            probe.unlink()
        except OSError as error:
            raise OutputError(
                f"{self.out}: can't be written ({error.strerror}), expected a folder of your own: "
                "choose another OUT"
            ) from None

    # --- files, which may be objects of an object storage

    @property
    def is_stored(self) -> bool:
        """Whether OUT is on object storage; then its files are local only while they are needed."""
        return workspace.is_mirrored(self.out)

    def has(self, file: Path) -> bool:
        """Return whether a file exists. It may also be one outside of OUT."""
        return workspace.is_file(file)

    def size(self, file: Path) -> int:
        """Return the bytes of a file; 0: it does not exist."""
        return workspace.sizes_below(file).get(file, 0)

    def names(self, folder: Path) -> list[str]:
        """Return the names in a folder; empty if there is none."""
        return workspace.names_in(folder)

    def remove(self, path: Path) -> None:
        """Remove a file, or a folder with all its files, if it exists."""
        workspace.remove(path)

    def fetch(self, folder: Path) -> None:
        """Fetch all files of a folder, for functions that read local files."""
        workspace.fetch(folder)

    def marks(self, folder: Path) -> list[tuple[str, int, str]] | None:
        """Return key, bytes and mark of all objects below a folder; None: OUT is a local folder."""
        return workspace.objects_below(folder)

    # --- the plan

    def save_plan(self, plan: Plan) -> None:
        """Write plan.json."""
        self.require_readable(plan)
        write_sealed(self.plan_file, to_json(self._without_place(plan)))

    def require_readable(self, plan: Plan) -> None:
        """Raise OutputError if commands could not read the plan after it is written."""
        content = to_json(self._without_place(plan))
        data = json.dumps(sealed(content)).encode()
        from_json(parse(self.plan_file, data, PLAN, NOT_WRITTEN), NOT_WRITTEN)

    def plan(self) -> Plan:
        """Return the plan. Raises OutputError if there is none or it breaks its schema."""
        remedy = "run `stereocell plan INPUT -o OUT` first"
        if self.plan_file.exists():
            remedy = f"remove it and {remedy}"
        return self._in_place(from_json(read_sealed(self.plan_file, PLAN, remedy)))

    def _without_place(self, plan: Plan) -> Plan:
        """Return a plan whose channel sources inside OUT are paths relative to OUT."""
        root = self.out.resolve()

        def relative(source: str) -> str:
            inside = source and Path(source).is_relative_to(root)
            return Path(source).relative_to(root).as_posix() if inside else source

        return _with_sources(plan, relative)

    def _in_place(self, plan: Plan) -> Plan:
        root = self.out.resolve()
        return _with_sources(plan, lambda source: str(root / source) if source else source)

    # --- results of the passes over the voxels

    def statistics_file(self, channel_id: str, key: str) -> Path:
        """Return the path of a channel's statistics."""
        return self.out / "units" / f"window-{channel_id}-{key}.json"

    def notes_file(self, labels_id: str, fingerprint: str) -> Path:
        """Return the path of the notes on objects from a label map's own file."""
        return self.out / "units" / f"notes-{labels_id}-{fingerprint[:12]}.json"

    def tile_result(self, pass_name: str, tile_id: str, channel_id: str, key: str) -> Path:
        """Return the path of the result of one pass for one tile."""
        return self.out / "units" / tile_id / channel_id / f"{pass_name}-{key}.json"

    def unit_dir(self, name: str, key: str) -> Path:
        """Return the folder of one unit's meshes and volume.

        name  `<tile>/<channel>`
        """
        return self.out / "units" / name / key

    def tile_file(self, tile_id: str) -> Path:
        """Return the path of the record of one tile of the stage."""
        return self.out / "units" / tile_id / "stage.json"

    def survey(self) -> dict[str, Any]:
        """Return the content of survey.json by channel ID. Raises OutputError."""
        found = read_sealed(self.survey_file, SURVEY, _RUN_UNITS)
        return dict(found["channels"])

    def save_survey(self, content: Mapping[str, Any]) -> None:
        write_sealed(self.survey_file, {"channels": dict(content)})

    def index(self) -> dict[str, str]:
        """Return the key of each finished unit, by `<tile>/<channel>`. Raises OutputError."""
        return read_sealed(self.index_file, INDEX, _RUN_UNITS)

    def save_units(self, plan: Plan, keys: Mapping[str, str]) -> None:
        """Save the units' keys, and a hash of the plan that they were built for."""
        write_sealed(self.index_file, keys)
        write_sealed(self.units_plan_file, {"key": self._key(plan)})

    def _key(self, plan: Plan) -> str:
        return key_of(to_json(replace(self._without_place(plan), notes=())))

    def _key_of_file(self) -> str:
        """Return the key of plan.json as it was written, which an earlier version may have done."""
        return key_of({**(find_sealed(self.plan_file, PLAN) or {}), "notes": []})

    def require_units_of(self, plan: Plan) -> None:
        """Raise OutputError unless all units of the plan are listed as built."""
        signed = find_sealed(self.units_plan_file, PLAN_KEY)
        if signed is None or signed["key"] not in (self._key(plan), self._key_of_file()):
            raise OutputError(
                f"{self.out / 'units'}: not built for the plan in {self.plan_file.name}: "
                f"{_RUN_UNITS}"
            )
        survey, index = self.survey(), self.index()
        for tile in plan.tiles:
            for channel in plan.channels:
                name = f"{tile.id}/{channel.id}"
                if tile.id not in survey.get(channel.id, {"iso": {}})["iso"]:
                    raise OutputError(f"{self.survey_file}: {name} is missing: {_RUN_UNITS}")
                if name not in index:
                    raise OutputError(f"{self.index_file}: {name} is missing: {_RUN_UNITS}")
        for tile_id, labels in product((tile.id for tile in plan.tiles), plan.labels):
            if f"{tile_id}/{labels.id}" not in index:
                raise OutputError(
                    f"{self.index_file}: {tile_id}/{labels.id} is missing: {_RUN_UNITS}"
                )

    def remove_other_folders(self, parent: Path, keep: set[str]) -> None:
        """Remove all folders in `parent` except `keep`. An earlier plan left them."""
        paths = [path.split("/") for path in sizes_of(parent)]
        for name in {parts[0] for parts in paths if len(parts) > 1} - keep:
            self.remove(parent / name)

    # --- the phases

    def phases(self) -> dict[str, dict[str, Any]]:
        """Return the record of each phase. If the file is damaged, no phase counts as done."""
        found = find_sealed(self.phases_file, PHASES)
        return dict.fromkeys(self._begun(), _UNFINISHED) if found is None else found

    def phases_fault(self) -> str | None:
        """Return a line on a damaged record of the phases; None: it is intact or missing."""
        if not workspace.is_file(self.phases_file):
            return None
        try:
            read_sealed(self.phases_file, PHASES, "all phases run again")
        except OutputError as fault:
            return str(fault)
        return None

    def has_begun(self, name: str) -> bool:
        """Return whether a phase has ever begun in OUT, in this version or an earlier one."""
        return name in self._begun()

    def _begun(self) -> set[str]:
        """Return the phases that phases.json names, even if an earlier version wrote it."""
        try:
            phases = read_json(self.phases_file, None, "")
        except OutputError:
            return set()
        return _NAMES & phases.keys() if isinstance(phases, dict) else set()

    def is_begun(self, name: str) -> bool:
        """Return whether a phase began and did not finish."""
        return not self.phases().get(name, {"key": "done"})["key"]

    def require_finished(self, name: str) -> None:
        """Raise OutputError if a phase began and did not finish, or its record is damaged."""
        if workspace.is_file(self.phases_file):
            read_sealed(self.phases_file, PHASES, PHASES_AGAIN)
        if self.is_begun(name):
            raise OutputError(
                f"{self.out / name}: began and did not finish: run `stereocell {name} OUT` first"
            )

    def save_phase(self, name: str, entry: Mapping[str, Any]) -> None:
        """Save the record of a phase; an empty key means that it isn't finished."""
        write_sealed(self.phases_file, {**self.phases(), name: entry})


def _with_sources(plan: Plan, change: Callable[[str], str]) -> Plan:
    channels = (replace(one, source=change(one.source)) for one in plan.channels)
    return replace(plan, channels=tuple(channels))
