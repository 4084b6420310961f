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

from stereocell.errors import UsageError
from stereocell.isovalue import IsoValueOptions
from stereocell.lod import LodOptions
from stereocell.options import setting
from stereocell.unwrap import UnwrapOptions

PRESETS = Path(__file__).parent / "presets"
AUTO = "auto"
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
    spacing_um: tuple[float, ...] = setting((), "voxel spacing z, y, x, instead of the file's")

    def __post_init__(self) -> None:
        if self.max_voxels < 1:
            raise UsageError(f"plan.max_voxels is {self.max_voxels}, expected at least 1")
        if self.time < 0:
            raise UsageError(f"plan.time is {self.time}, expected 0 or more (--time)")
        if self.spacing_um and not (len(self.spacing_um) == 3 and min(self.spacing_um) > 0):
            found = ",".join(f"{value:g}" for value in self.spacing_um)
            raise UsageError(
                f"plan.spacing_um: found {found}, expected z,y,x in um, each above 0 (--spacing-um)"
            )


@dataclass(frozen=True, slots=True)
class WindowOptions:
    """Which voxel values become 0 and 255, dataset-wide."""

    low_percentile: float = setting(0.5, "percent of the voxels that become 0")
    high_percentile: float = setting(99.95, "percent of the voxels that stay below 255")

    def __post_init__(self) -> None:
        if not 0 <= self.low_percentile < self.high_percentile <= 100:
            raise UsageError(
                f"window percentiles are {self.low_percentile:g} and {self.high_percentile:g}, "
                "expected 0 <= low < high <= 100"
            )


@dataclass(frozen=True, slots=True)
class SurfaceOptions:
    """Lengths in um; auto follows the voxel spacing."""

    smoothing_um: float | str = setting(AUTO, "sigma of the Gaussian; auto: the finest spacing")
    alpha_um: float | str = setting(
        AUTO, "radius of the ball that closes gaps; auto: 2 coarsest spacings"
    )
    min_diagonal_um: float | str = setting(AUTO, "smaller fragments go; auto: 3 coarsest spacings")
    max_cavity_um: float | str = setting(AUTO, "smaller cavities fill; auto: 4 coarsest spacings")
    background_um: float | str = setting(
        AUTO, "blocks of the background, as large as the largest bodies; auto: 64 finest; 0: none"
    )

    def resolved(self, spacing_um: tuple[float, float, float]) -> "SurfaceOptions":
        """Return the options with every `auto` replaced by a length."""
        auto = {
            "smoothing_um": min(spacing_um),
            "alpha_um": 2 * max(spacing_um),
            "min_diagonal_um": 3 * max(spacing_um),
            "max_cavity_um": 4 * max(spacing_um),
            "background_um": 64 * min(spacing_um),
        }
        lengths = {key: _length(f"surface.{key}", getattr(self, key), auto[key]) for key in auto}
        return SurfaceOptions(**lengths)


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


def load(preset: str | None, config: Path | None, flags: Mapping[str, Any]) -> Settings:
    """Return the settings of a preset (name or TOML file), a TOML file and flags, in that order.

    `flags` is nested as the TOML is: {"plan": {"level": 1}}. Raises UsageError.
    """
    settings = Settings()
    if preset is not None:
        settings = apply(settings, _read(preset_path(preset)), f"preset {preset}")
    if config is not None:
        settings = apply(settings, _read(config), str(config))
    return apply(settings, flags, "command line")


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
        if section == "iso_values":
            given = {k: _typed(f"{where}: iso_values.{k}", v, "float") for k, v in content.items()}
            settings = replace(settings, iso_values={**settings.iso_values, **given})
            continue
        current = getattr(settings, section)
        types = {f.name: str(f.type) for f in fields(current)}
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
            lines.append("# channel = voxel value, instead of the iso-value that is found")
            lines += [f"{_toml(key)} = {_toml(number)}" for key, number in value.items()]
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
    if isinstance(value, tuple):
        return "[" + ", ".join(_toml(v) for v in value) + "]"
    return repr(value)


def _read(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            return tomllib.load(file)
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}, expected a TOML file of settings") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UsageError(f"{path}: not TOML: {error}") from None


def _known(key: str, known: list[str], where: str, what: str) -> None:
    if key in known:
        return
    near = get_close_matches(key, known, 1)
    hint = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(known)}"
    raise UsageError(f"{where}: unknown {what} {key!r}; {hint}")


def _typed(where: str, value: Any, expected: str) -> Any:
    """Return the value as the field's type (its annotation as text), or raise UsageError."""
    number = isinstance(value, int | float) and not isinstance(value, bool) and _is_finite(value)
    whole = isinstance(value, int) and not isinstance(value, bool)
    if expected.startswith("tuple["):
        inner = expected.removeprefix("tuple[").split(",")[0]
        if isinstance(value, list | tuple):
            return tuple(_typed(where, v, inner) for v in value)
    elif "str" in expected and isinstance(value, str):
        return value
    elif ("float" in expected and number) or ("int" in expected and whole):
        return float(value) if "float" in expected else value
    plain = {"str": "text", "int": "a whole number", "float": "a number"}
    wanted = "a list" if expected.startswith("tuple[") else plain.get(expected, expected)
    if wanted == expected:
        wanted = f"{'a number' if 'float' in expected else 'a whole number'} or {AUTO!r}"
    raise UsageError(f"{where} is {value!r}, expected {wanted}")


def _length(where: str, value: float | str, auto: float) -> float:
    if value == AUTO:
        return auto
    if isinstance(value, str) or not value >= 0:
        raise UsageError(f"{where} is {value!r}, expected a length in um or {AUTO!r}")
    return value


def _is_finite(value: float) -> bool:
    try:
        return isfinite(value)
    except OverflowError:  # TOML's whole numbers have no end
        return False
