"""All settings: their sections, how TOML files and flags fill them, and how they are written out.

Order of precedence: defaults < preset < configuration file < flags. Unknown keys are errors.
"""

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from difflib import get_close_matches
from math import isfinite
from pathlib import Path
from typing import Any

from stereocell.isosurface.options import IsoValueOptions, SurfaceOptions
from stereocell.meshes.options import LodOptions
from stereocell.model.errors import UsageError
from stereocell.model.modality import MODALITIES
from stereocell.model.settings import AUTO, setting
from stereocell.textures.options import UnwrapOptions
from stereocell.transfer.options import WindowOptions

PRESETS = Path(__file__).parent / "presets"
# of a file of settings; tomllib's time grows with the square of a dotted key's length
_MAX_BYTES, _MAX_LINE = 1 << 17, 2000
# What the first lines of a file of settings say about it.
TEMPLATE = "StereoCell settings. Every key may be left out; unknown keys are errors."
RECORD = (
    "The settings that this build used; each build writes them anew.\n"
    "To change them, copy this file and pass the copy with --config."
)


@dataclass(frozen=True, slots=True)
class PlanOptions:
    """What of the dataset is built, and how it is cut."""

    level: int | str = setting(AUTO, "resolution level, 0 is the finest; auto: see max_voxels")
    max_voxels: int = setting(
        2_000_000_000, "auto takes the finest level within this: the region, all channels"
    )
    channels: tuple[str, ...] = setting((), "names or indices; empty: all")
    region: str = setting("", "z0:z1,y0:y1,x0:x1 in voxels of the level that is built; empty: all")
    tile_size: tuple[int, ...] = setting((194, 512, 512), "voxels z, y, x, clipped to the data")
    grid: str = setting("", "columns x rows of equal tiles, as 5x2; instead of tile_size")
    time: int = setting(0, "index into a time series")
    series: int = setting(0, "which series of DICOM, from 1 as --series list counts; 0: largest")
    spacing_um: tuple[float, ...] = setting((), "voxel spacing z, y, x, instead of the file's")
    modality: str = setting(
        "", "where the input says none: a term of DICOM's Modality; MR and CT open path-traced"
    )

    def __post_init__(self) -> None:
        if self.max_voxels < 1:
            raise UsageError(f"plan.max_voxels is {self.max_voxels}, expected at least 1")
        if self.time < 0:
            raise UsageError(f"plan.time is {self.time}, expected 0 or more (--time)")
        if self.series < 0:
            raise UsageError(f"plan.series is {self.series}, expected 0 or more (--series)")
        if self.spacing_um and not (len(self.spacing_um) == 3 and min(self.spacing_um) > 0):
            found = ",".join(f"{value:g}" for value in self.spacing_um)
            raise UsageError(
                f"plan.spacing_um: found {found}, expected z,y,x in um, each above 0 (--spacing-um)"
            )
        if self.modality and self.modality not in MODALITIES:
            raise UsageError(
                f"plan.modality is {self.modality!r}, expected one of "
                f"{', '.join(sorted(MODALITIES))}, or nothing"
            )


@dataclass(frozen=True, slots=True)
class Settings:
    """Every setting of a build."""

    plan: PlanOptions = field(default_factory=PlanOptions)
    window: WindowOptions = field(default_factory=WindowOptions)
    isovalue: IsoValueOptions = field(default_factory=IsoValueOptions)
    surface: SurfaceOptions = field(default_factory=SurfaceOptions)
    lod: LodOptions = field(default_factory=LodOptions)
    unwrap: UnwrapOptions = field(default_factory=UnwrapOptions)
    # voxel values that override what is found, by channel name
    iso_values: Mapping[str, float] = field(default_factory=dict)
    # whose intensity is painted on a channel's surface, by that channel's name
    paint: Mapping[str, str] = field(default_factory=dict)


# sections that are no fixed keys but channels: what a value is, and what the file says of them
_BY_CHANNEL = {
    "iso_values": ("float", "channel = voxel value, instead of the iso-value that is found"),
    "paint": ("str", "channel = channel whose intensity is painted on its surface"),
}


def load(
    preset: str | None,
    config: Path | None,
    *,
    flags: Mapping[str, Any],
    where: str = "command line",
) -> Settings:
    """Return the settings of a preset (name or TOML file), a TOML file and flags, in that order.

    `flags` is nested as the TOML is: {"plan": {"level": 1}}; `where` they stand. Raises UsageError.
    """
    settings = Settings()
    if preset is not None:
        settings = apply(settings, _read(preset_path(preset)), f"preset {preset}")
    if config is not None:
        settings = apply(settings, _read(config), str(config))
    return apply(settings, flags, where)


def preset_path(preset: str) -> Path:
    """Return the file of a preset: one of ours by name, or the user's own TOML file."""
    if preset.endswith(".toml"):
        return Path(preset)
    path = PRESETS / f"{preset}.toml"
    if not path.is_file():
        known = sorted(p.stem for p in PRESETS.glob("*.toml"))
        raise UsageError(
            f"preset {preset!r} is unknown, expected one of {', '.join(known)} or a .toml file"
        )
    return path


def apply(settings: Settings, values: Mapping[str, Any], where: str) -> Settings:
    """Return the settings with `values` ({section: {key: value}}) put in. Raises UsageError."""
    for section, content in values.items():
        _known(section, [f.name for f in fields(settings)], where, "section")
        if not isinstance(content, Mapping):
            raise UsageError(f"{where}: {section} is {content!r}, expected a table")
        if section in _BY_CHANNEL:
            type_ = _BY_CHANNEL[section][0]
            given = {k: _typed(f"{where}: {section}.{k}", v, type_) for k, v in content.items()}
            merged: dict[str, Any] = {section: {**getattr(settings, section), **given}}
            settings = replace(settings, **merged)
            continue
        current = getattr(settings, section)
        types = {f.name: _annotation(f.type) for f in fields(current)}
        for key in content:
            _known(key, list(types), f"{where}: {section}", "key")
        typed = {k: _typed(f"{where}: {section}.{k}", v, types[k]) for k, v in content.items()}
        if section == "plan" and "tile_size" in typed:
            typed = {"grid": "", **typed}  # later settings win over an earlier grid
        settings = replace(settings, **{section: replace(current, **typed)})
    return settings


def to_dict(settings: Settings) -> dict[str, Any]:
    """Return the settings as plain values, tuples as lists."""
    sections = {}
    for f in fields(settings):
        value = getattr(settings, f.name)
        content = _plain(value) if is_dataclass(value) else dict(value)
        sections[f.name] = content
    return sections


def from_dict(values: Mapping[str, Any]) -> Settings:
    """Return the settings that `to_dict` was given."""
    return apply(Settings(), values, "plan.json: settings")


def to_toml(settings: Settings, header: str = RECORD) -> str:
    """Return every setting as TOML, each with its comment, below the header's lines."""
    lines = [f"# {line}" for line in header.splitlines()]
    for section in fields(settings):
        value = getattr(settings, section.name)
        lines += ["", f"[{section.name}]"]
        if not is_dataclass(value):
            lines.append(f"# {_BY_CHANNEL[section.name][1]}")
            lines += [f"{_toml(key)} = {_toml(given)}" for key, given in value.items()]
            continue
        for f in fields(value):
            lines.append(f"{f.name} = {_toml(getattr(value, f.name))}  # {f.metadata['comment']}")
    return "\n".join(lines) + "\n"


def _plain(value: Any) -> dict[str, Any]:
    content = {f.name: getattr(value, f.name) for f in fields(value)}
    return {k: list(v) if isinstance(v, tuple) else v for k, v in content.items()}


def _toml(value: Any) -> str:
    if isinstance(value, str):
        # a TOML string is a JSON string, but for DEL
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    return repr(value)


def _read(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            content = file.read(_MAX_BYTES + 1)
        longest = max(map(len, content.splitlines()), default=0)
        if len(content) > _MAX_BYTES or longest > _MAX_LINE:
            raise UsageError(
                f"{path}: found {len(content)} bytes or more, {longest} in a line, expected "
                f"settings of at most {_MAX_BYTES}, {_MAX_LINE} in a line"
            )
        return tomllib.loads(content.decode())
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}, expected a TOML file of settings") from None
    except (ValueError, RecursionError) as error:  # tomllib's own, no UTF-8, endless numbers
        raise UsageError(f"{path}: not TOML: {error!s:.200}") from None


def _known(key: str, known: list[str], where: str, what: str) -> None:
    if key in known:
        return
    near = get_close_matches(key, known, 1)
    hint = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(known)}"
    raise UsageError(f"{where}: unknown {what} {key!r:.80}; {hint}")


def _annotation(type_: Any) -> str:
    """Return a field's type as its annotation is written: `bool`, `float | str`."""
    return type_.__name__ if isinstance(type_, type) else str(type_)


def _typed(where: str, value: Any, expected: str) -> Any:
    """Return the value as the field's type (its annotation as text), or raise UsageError."""
    number = isinstance(value, int | float) and not isinstance(value, bool) and _is_finite(value)
    whole = isinstance(value, int) and not isinstance(value, bool)
    if expected.startswith("tuple["):
        inner = expected.removeprefix("tuple[").split(",")[0]
        if isinstance(value, list | tuple):
            return tuple(_typed(where, v, inner) for v in value)
    elif ("str" in expected and isinstance(value, str)) or (
        "bool" in expected and isinstance(value, bool)
    ):
        return value
    elif ("float" in expected and number) or ("int" in expected and whole):
        return float(value) if "float" in expected else value
    plain = {
        "str": "text", "int": "a whole number", "float": "a number", "bool": "true or false"
    }  # fmt: skip
    wanted = "a list" if expected.startswith("tuple[") else plain.get(expected, expected)
    if wanted == expected:
        wanted = f"{'a number' if 'float' in expected else 'a whole number'} or {AUTO!r}"
    raise UsageError(f"{where} is {value!r:.80}, expected {wanted}")


def _is_finite(value: float) -> bool:
    try:
        return isfinite(value)
    except OverflowError:  # TOML's whole numbers have no end
        return False
