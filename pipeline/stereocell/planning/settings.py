"""All settings: their sections, how TOML files and flags fill them, and how they are written out.

Order of precedence: defaults < preset < configuration file < flags. Unknown keys are errors.
"""

import json
import tomllib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, is_dataclass
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from stereocell.isosurface.options import IsoValueOptions, SurfaceOptions, parse_level
from stereocell.meshes.options import LodOptions
from stereocell.model.axes import axes_of, is_axes
from stereocell.model.errors import UsageError
from stereocell.model.modality import MODALITIES
from stereocell.model.settings import (
    AUTO,
    COUNT,
    COUNT_OR_NONE,
    EIGHT_BITS,
    LENGTH_UM,
    Bounds,
    Flag,
    require_bounds,
    setting,
)
from stereocell.objects.options import ObjectOptions
from stereocell.planning.setting_values import finite, require_utf8
from stereocell.storage.documents import SETTINGS
from stereocell.textures.options import UnwrapOptions
from stereocell.transfer.options import WindowOptions
from stereocell.transfer.windows import parse_window

if TYPE_CHECKING:
    from pydantic import TypeAdapter

MAX_INDEX = 2**31  # of levels, and of voxels along an axis
# values of taken_as: voxels are intensities, even if they look like labels, or Hounsfield units,
# even if neither the source nor air and fat among the voxels show it
INTENSITY, HOUNSFIELD = "intensity", "hounsfield"
NO_PRESET = "none"  # names the defaults
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

    level: int | str = setting(
        AUTO,
        "resolution level, 0 is the finest; auto: see max_voxels",
        flag=Flag(
            "--level", "resolution level, 0 is the finest (default auto: see plan.max_voxels)"
        ),
        bounds=Bounds(-MAX_INDEX, MAX_INDEX),
    )
    max_voxels: int = setting(
        2_000_000_000,
        "auto takes the finest level within this: the region, all channels",
        bounds=COUNT,
    )
    channels: tuple[str, ...] = setting(
        (),
        "names or indices; empty: all",
        flag=Flag(
            "--channels", "names or indices, as CD31,MART1", "names or indices, as CD31,MART1"
        ),
    )
    region: str = setting(
        "",
        "z0:z1,y0:y1,x0:x1 in voxels of the level that is built; empty: all",
        flag=Flag(
            "--region",
            "z0:z1,y0:y1,x0:x1 in voxels of the level that is built: without --level the finest "
            "whose region stays within plan.max_voxels",
        ),
    )
    tile_size: tuple[int, ...] = setting(
        (194, 512, 512),
        "voxels z, y, x, clipped to the data",
        flag=Flag("--tile-size", "z,y,x in voxels", "three numbers z,y,x"),
        bounds=Bounds(-MAX_INDEX, MAX_INDEX),
    )
    grid: str = setting(
        "",
        "columns x rows of equal tiles, as 5x2; instead of tile_size",
        flag=Flag("--grid", "columns x rows of equal tiles, as 5x2; not with --tile-size"),
    )
    time: int = setting(0, "index into a time series", flag=Flag("--time"), bounds=COUNT_OR_NONE)
    series: int = setting(
        0,
        "which of several images of a source, from 1 as --series list counts; 0: the largest",
        flag=Flag(
            "--series",
            "which of several images of a source: series of DICOM or planes, segments, scenes of "
            "CZI, LIF, ND2, tiles and angles of BigDataViewer, angles of OME-TIFF (default: the "
            "largest); `list` shows them and does nothing else",
            "N|list",
        ),
        bounds=COUNT_OR_NONE,
    )
    pattern: str = setting(
        "",
        "how the files of a folder of planes are named, as img_c{c}_z{z}.tif; empty: guessed",
        flag=Flag(
            "--pattern",
            "how the files of a folder of planes are named: {z} for the plane's number, {c} for "
            "the channel, {t} for the time, * for anything else, as img_c{c}_z{z}.tif (default: "
            "guessed)",
        ),
    )
    axes: str = setting(
        "",
        "axes of a TIFF, HDF5, Zarr or N5 array longer than 1, as czyx; empty: what the file says",
        flag=Flag(
            "--axes",
            "axes of a TIFF, HDF5, Zarr or N5 array longer than 1, slowest first, as zyx or czyx: "
            "where the file names none, or a TIFF's are wrong",
        ),
    )
    dark: bool = setting(
        False,
        "structures are darker than their surroundings, as in electron microscopy: values are "
        "inverted",
        flag=Flag(
            "--dark",
            "structures are darker than their surroundings, as membranes in electron microscopy: "
            "all values are inverted",
        ),
    )
    spacing_um: tuple[float, ...] = setting(
        (),
        "voxel spacing z, y, x, instead of the file's",
        flag=Flag(
            "--spacing-um",
            "z,y,x voxel spacing in um, instead of the file's",
            "three numbers z,y,x",
        ),
        bounds=LENGTH_UM,
    )
    taken_as: str = setting(
        "",
        "intensity: build what looks like a label map all the same; hounsfield: values of a CT are "
        "Hounsfield units",
        flag=Flag(
            "--as",
            "intensity: build what looks like a label map all the same; hounsfield: the values of "
            "a CT are Hounsfield units, though the source does not show it",
        ),
    )
    neurological: bool = setting(
        False,
        "pictures of a patient have right on the right, and not as radiologists do",
        flag=Flag("--neurological", "pictures of a patient with right on the right"),
    )
    modality: str = setting(
        "",
        "where the input states none: DICOM's Modality; MR and CT open path-traced, PT as heat",
        flag=Flag(
            "--modality",
            "what took a volume that does not say so: MR, CT, PT, ..., GM for a microscope",
        ),
    )

    def __post_init__(self) -> None:
        if self.axes and not is_axes(axes_of(self.axes)):
            raise UsageError(
                f"plan.axes is {self.axes!r:.40}, expected z, y and x, and t and c where there are "
                "any, each once, as czyx"
            )
        if self.spacing_um and not (len(self.spacing_um) == 3 and min(self.spacing_um) > 0):
            found = ",".join(f"{value:g}" for value in self.spacing_um)
            raise UsageError(f"plan.spacing_um: found {found}, expected z,y,x in um, each above 0")
        require_bounds("plan", self)
        if self.taken_as not in ("", INTENSITY, HOUNSFIELD):
            raise UsageError(
                f"plan.taken_as is {self.taken_as!r:.40}, expected {INTENSITY} or "
                f"{HOUNSFIELD}, or nothing"
            )
        if self.modality and self.modality not in MODALITIES:
            raise UsageError(
                f"plan.modality is {self.modality!r}, expected one of "
                f"{', '.join(sorted(MODALITIES))}, or nothing"
            )


@dataclass(frozen=True, slots=True)
class VolumeOptions:
    """What the stage keeps of the voxels, beside the surfaces."""

    bits: int = setting(
        16,
        "16: the stage has the voxels as measured beside those of 8 bits; 8: these alone",
        flag=Flag(
            "--bits",
            "16 (default): the stage keeps the voxels as measured, so that another window loses "
            "nothing; 8: those of 8 bits alone, about half the size",
        ),
        bounds=COUNT_OR_NONE,
    )
    without_vdb: bool = setting(
        False,
        "the stage has no .vdb files: other programs draw no volumes, and another window is "
        "applied to the voxels of 8 bits",
        flag=Flag(
            "--without-vdb",
            "a small stage without .vdb files: bundle and viewer keep their volumes, other "
            "programs draw surfaces alone; implies --bits 8",
        ),
    )

    def __post_init__(self) -> None:
        if self.bits not in (EIGHT_BITS, 16):
            raise UsageError(f"volume.bits is {self.bits}, expected 8 or 16")


@dataclass(frozen=True, slots=True)
class Settings:
    """Every setting of a build."""

    plan: PlanOptions = field(default_factory=PlanOptions)
    window: WindowOptions = field(default_factory=WindowOptions)
    volume: VolumeOptions = field(default_factory=VolumeOptions)
    isovalue: IsoValueOptions = field(default_factory=IsoValueOptions)
    surface: SurfaceOptions = field(default_factory=SurfaceOptions)
    lod: LodOptions = field(default_factory=LodOptions)
    unwrap: UnwrapOptions = field(default_factory=UnwrapOptions)
    objects: ObjectOptions = field(default_factory=ObjectOptions)
    iso_values: Mapping[str, float | str] = setting(
        {},
        "channel = voxel value, or one above the background as 162+b, instead of what is found",
        flag=Flag(
            "--iso-value",
            "use this iso-value (a voxel value, or one above the background as 162+b) for a "
            "channel, by name or index, or * for all others; may be repeated",
            "CHANNEL=VALUE",
        ),
    )
    surfaces: Mapping[str, str] = setting(
        {},
        "channel = the surfaces built of it: outer, inner, third, or voxel values, between "
        "commas; a value above the background as 162+b; or none",
        flag=Flag(
            "--surfaces",
            "which surfaces are built of a channel: outer, inner, third, or voxel values, between "
            "commas; or none; may be repeated",
            "CHANNEL=SURFACE,...",
        ),
    )
    windows: Mapping[str, str] = setting(
        {},
        "channel = LOW:HIGH, voxel values that become 0 and 255, or brain, bone, lung, soft (CT)",
        flag=Flag(
            "--window",
            "the voxel values of a channel that become 0 and 255, as CT=-160:240, or a CT's window "
            "by name: brain, bone, lung, soft; * names all others; may be repeated",
            "CHANNEL=LOW:HIGH",
        ),
    )
    paint: Mapping[str, str] = setting(
        {},
        "channel or label map = channel whose intensity is painted on its surface",
        flag=Flag(
            "--paint",
            "paint the second channel's intensity on the first one's surface, as CD31=MART1; "
            "may be repeated",
            "CHANNEL=CHANNEL",
        ),
    )

    labels: Mapping[str, str] = setting(
        {},
        "label maps whose objects are built: name = path; empty: one of the input's own labels; .: "
        "the input itself",
        flag=Flag(
            "--labels",
            "build the objects of a label map: one of the input's own by name, or NAME=PATH; "
            "--labels . takes the input itself for one; may be repeated",
            "NAME[=PATH]",
        ),
    )

    def __post_init__(self) -> None:
        for channel, value in self.iso_values.items():
            parse_level(f"iso_values.{channel}", value)
        for channel, window in self.windows.items():
            parse_window(f"windows.{channel}", window)


# What is expected where pydantic finds another type
_EXPECTED = {
    "float_type": "a number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "string_type": "text",
    "bool_type": "true or false",
    "tuple_type": "a list",
}


def load(
    preset: str | None,
    config: Path | None,
    *,
    flags: Mapping[str, Any],
    where: str = "command line",
) -> Settings:
    """Return the settings of a preset (name, TOML file or none), a TOML file and flags, in order.

    `flags` is nested as the TOML is: {"plan": {"level": 1}}; `where` they stand. Raises UsageError.
    """
    settings = Settings()
    if preset not in (None, NO_PRESET):
        settings = _apply_file(settings, preset_path(preset), f"preset {preset}")
    if config is not None:
        settings = _apply_file(settings, config, str(config))
    return apply(settings, flags, where)


def _apply_file(settings: Settings, path: Path, where: str) -> Settings:
    """Return the settings with those of a file put in. Raises UsageError, which names the file."""
    values = _read(path)
    try:
        return apply(settings, values, where)
    except UsageError as error:
        line = str(error)
        raise UsageError(line if line.startswith(where) else f"{where}: {line}") from None


def preset_names() -> list[str]:
    """Return the names that --preset takes."""
    return sorted(path.stem for path in PRESETS.glob("*.toml"))


def preset_path(preset: str) -> Path:
    """Return the file of a preset: one of ours by name, or the user's own TOML file."""
    if preset.endswith(".toml"):
        return Path(preset)
    if preset not in preset_names():
        known = ", ".join(preset_names())
        raise UsageError(f"preset {preset!r} is unknown, expected one of {known} or a .toml file")
    return PRESETS / f"{preset}.toml"


def apply(settings: Settings, values: Mapping[str, Any], where: str) -> Settings:
    """Return the settings with `values` ({section: {key: value}}) put in. Raises UsageError."""
    merged = to_dict(settings)
    by_channel = {section for section in merged if not is_dataclass(getattr(settings, section))}
    for section, content in values.items():
        _known(section, list(merged), where, "section")
        if not isinstance(content, Mapping):
            raise UsageError(f"{where}: {section} is {content!r:.80}, expected a table")
        if section not in by_channel:
            for key in content:
                _known(key, list(merged[section]), f"{where}: {section}", "key")
        if section == "plan" and "tile_size" in content:
            merged["plan"]["grid"] = ""  # later settings win over an earlier grid
        merged[section] |= content
    return _validate(merged, where)


def _validate(content: Mapping[str, Any], where: str) -> Settings:
    """Return the settings that plain values are, each of its field's type; or raise UsageError.

    In JSON's strictness a whole number is a number, a list a tuple, a table a dataclass, and
    nothing else is taken for another.
    """
    from pydantic import ValidationError  # slow to import

    require_utf8(content, where)
    try:
        return _adapter().validate_json(json.dumps(finite(content), default=str), strict=True)
    except ValidationError as error:
        faults = error.errors(include_url=False)
    place = faults[0]["loc"][:2]
    value: Any = content
    for key in place:
        value = value[key]
    # a list's fault may lie in one of its values; of a union each type has a fault of its own
    inner = [fault["loc"][2] for fault in faults if len(fault["loc"]) > 2]
    if inner and isinstance(inner[0], int):
        value = value[inner[0]]
    wanted = [_EXPECTED.get(f["type"], f["msg"]) for f in faults if f["loc"][:2] == place]
    if len(wanted) > 1:
        wanted = [repr(AUTO) if word == "text" else word for word in wanted]
    expected = " or ".join(dict.fromkeys(wanted))
    name = ".".join(map(str, place)) or "settings"
    raise UsageError(f"{where}: {name} is {value!r:.80}, expected {expected}")


@cache
def _adapter() -> "TypeAdapter[Settings]":
    from pydantic import TypeAdapter

    return TypeAdapter(Settings)


def to_dict(settings: Settings) -> dict[str, Any]:
    """Return the settings as plain values, tuples as lists."""
    sections = asdict(settings)
    return {
        name: {k: list(v) if isinstance(v, tuple) else v for k, v in content.items()}
        for name, content in sections.items()
    }


def from_dict(values: Mapping[str, Any]) -> Settings:
    """Return the settings that `to_dict` was given."""
    return apply(Settings(), values, "plan.json: settings")


def to_toml(settings: Settings, *, header: str = RECORD) -> str:
    """Return every setting as TOML, each with its comment, below the header's lines."""
    lines = [f"# {line}" for line in header.splitlines()]
    for section in fields(settings):
        value = getattr(settings, section.name)
        lines += ["", f"[{section.name}]"]
        if not is_dataclass(value):
            lines.append(f"# {section.metadata['comment']}")
            lines += [f"{_toml(key)} = {_toml(given)}" for key, given in value.items()]
            continue
        for f in fields(value):
            lines.append(f"{f.name} = {_toml(getattr(value, f.name))}  # {f.metadata['comment']}")
    return "\n".join(lines) + "\n"


def to_readable_toml(settings: Settings) -> str:
    """Return the settings as `to_toml` does. Raises UsageError where `load` would read others."""
    text = to_toml(settings)
    if apply(Settings(), tomllib.loads(text), SETTINGS) != settings:
        raise UsageError(
            f"{SETTINGS}: these settings can't be written to it: they would be read as other ones"
        )
    return text


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
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise UsageError(
            f"{path}: line {line}: found byte 0x{content[error.start]:02x}, expected UTF-8: save "
            "the file in this encoding"
        ) from None
    except (ValueError, RecursionError) as error:  # tomllib's own, no UTF-8, endless numbers
        raise UsageError(f"{path}: not TOML: {error!s:.200}") from None


def _known(key: str, known: list[str], where: str, what: str) -> None:
    if key in known:
        return
    near = get_close_matches(key, known, 1)
    hint = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(known)}"
    raise UsageError(f"{where}: unknown {what} {key!r:.80}; {hint}")
