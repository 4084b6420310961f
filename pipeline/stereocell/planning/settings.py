"""All settings: their sections, how TOML files and flags set them, and how they are written.

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
from stereocell.planning.earlier_names import (
    COMMAND_LINE,
    print_earlier_names,
    with_present_names,
)
from stereocell.planning.setting_values import finite, require_utf8
from stereocell.storage.documents import SETTINGS
from stereocell.textures.options import UnwrapOptions
from stereocell.transfer.options import WindowOptions
from stereocell.transfer.windows import parse_window

if TYPE_CHECKING:
    from pydantic import TypeAdapter

MAX_INDEX = 2**31  # largest index of a level, and of a voxel along an axis
# Values of taken_as. The voxels are intensities even if they look like labels, or Hounsfield units
# even if neither the source nor its voxels show it.
INTENSITY, HOUNSFIELD = "intensity", "hounsfield"
NO_PRESET = "none"  # name for the default settings without a preset
PRESETS = Path(__file__).parent / "presets"
# Bytes, characters: limits of a file of settings and of its lines. The time that tomllib needs for
# a dotted key grows with the square of its length.
_MAX_BYTES, _MAX_LINE = 1 << 17, 2000
# First lines of a file of settings.
TEMPLATE = "StereoCell settings. Every key may be left out; unknown keys are errors."
RECORD = (
    "The settings that this build used. The next build overwrites this file.\n"
    "To change settings, copy this file and pass the copy with --config."
)


@dataclass(frozen=True, slots=True)
class PlanOptions:
    """The part of the dataset that is built, and how it is cut into tiles."""

    level: int | str = setting(
        AUTO,
        "resolution level, 0 is the finest; auto: the finest within max_voxels",
        flag=Flag(
            "--level",
            "resolution level, 0 is the finest (default auto: the finest within plan.max_voxels)",
        ),
        bounds=Bounds(-MAX_INDEX, MAX_INDEX),
    )
    max_voxels: int = setting(
        2_000_000_000,
        "largest number of voxels of the region, all channels together, for level = auto",
        bounds=COUNT,
    )
    channels: tuple[str, ...] = setting(
        (),
        "channels to build, by name or index; empty: all",
        flag=Flag(
            "--channels",
            "channels to build, by name or index, such as CD31,MART1",
            "names or indices, such as CD31,MART1",
        ),
    )
    region: str = setting(
        "",
        "part to build, such as z0:z1,y0:y1,x0:x1 in voxels of the resolution level that is "
        "built; empty: all",
        flag=Flag(
            "--region",
            "part to build, such as z0:z1,y0:y1,x0:x1 in voxels of the resolution level that is "
            "built (without --level the finest one whose region has at most plan.max_voxels). The "
            "--region of `export` is in um instead, x first",
        ),
    )
    tile_size: tuple[int, ...] = setting(
        (194, 512, 512),
        "size of a tile z, y, x in voxels, at most that of the data",
        flag=Flag("--tile-size", "size of a tile z,y,x in voxels", "three numbers z,y,x"),
        bounds=Bounds(-MAX_INDEX, MAX_INDEX),
    )
    grid: str = setting(
        "",
        "columns x rows of equal tiles, such as 5x2; instead of tile_size",
        flag=Flag("--grid", "columns x rows of equal tiles, such as 5x2; not with --tile-size"),
    )
    time: int = setting(
        0,
        "point in time of a series, counted from 0",
        flag=Flag("--time"),
        bounds=COUNT_OR_NONE,
    )
    series: int = setting(
        0,
        "number of the image in a source of several, as --series list counts; 0: the largest",
        flag=Flag(
            "--series",
            "number of the image in a source of several (default: the largest), or `list` to print "
            "them; an image is a series of DICOM or of planes, a segment, a scene of CZI, LIF or "
            "ND2, a tile or angle of BigDataViewer, or an angle of OME-TIFF",
            "N|list",
        ),
        bounds=COUNT_OR_NONE,
    )
    pattern: str = setting(
        "",
        "names of the files in a folder of planes, such as img_c{c}_z{z}.tif; empty: guessed",
        flag=Flag(
            "--pattern",
            "names of the files in a folder of planes, such as img_c{c}_z{z}.tif (default: "
            "guessed); {z} stands for the plane's number, {c} for the channel, {t} for the time, * "
            "for anything",
        ),
    )
    axes: str = setting(
        "",
        "axes of a TIFF, HDF5, Zarr or N5 array longer than 1, such as czyx; empty: the file's",
        flag=Flag(
            "--axes",
            "axes of a TIFF, HDF5, Zarr or N5 array longer than 1, slowest first, such as zyx or "
            "czyx, if the file names none or a TIFF names wrong ones",
        ),
    )
    dark: bool = setting(
        False,
        "invert all values, for structures darker than their surroundings (electron microscopy)",
        flag=Flag(
            "--dark",
            "invert all values, for structures that are darker than their surroundings, such as "
            "membranes in electron microscopy",
        ),
    )
    spacing_um: tuple[float, ...] = setting(
        (),
        "voxel spacing z, y, x in um, instead of the file's",
        flag=Flag(
            "--spacing-um",
            "voxel spacing z,y,x in um, instead of the file's",
            "three numbers z,y,x",
        ),
        bounds=LENGTH_UM,
    )
    taken_as: str = setting(
        "",
        "intensity: build an image even if it looks like a label map; hounsfield: take the values "
        "of a CT for Hounsfield units",
        flag=Flag(
            "--as",
            "intensity: build an image even if it looks like a label map; hounsfield: take the "
            "values of a CT for Hounsfield units, even if the source does not show it",
        ),
    )
    neurological: bool = setting(
        False,
        "images of a patient show the patient's right on the right, unlike radiologists' images",
        flag=Flag("--neurological", "show the patient's right on the right in images"),
    )
    modality: str = setting(
        "",
        "DICOM's Modality, if the input states none; MR and CT open path-traced, PT as heat",
        flag=Flag(
            "--modality",
            "DICOM's code for the scanner, if the input states none: MR, CT, PT, ..., GM for a "
            "microscope",
        ),
    )

    def __post_init__(self) -> None:
        if self.axes and not is_axes(axes_of(self.axes)):
            raise UsageError(
                f"plan.axes is {self.axes!r:.40}, expected z, y and x, and t and c if the array "
                "has them, each once, such as czyx"
            )
        if self.spacing_um and not (len(self.spacing_um) == 3 and min(self.spacing_um) > 0):
            found = ",".join(f"{value:g}" for value in self.spacing_um)
            raise UsageError(f"plan.spacing_um is {found}, expected z,y,x in um, each above 0")
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
    """The voxels that the stage keeps besides the surfaces."""

    bits: int = setting(
        16,
        "16: the stage keeps the voxels as measured and in 8 bits; 8: only in 8 bits",
        flag=Flag(
            "--bits",
            "16 (default): the stage keeps the voxels as measured and in 8 bits, so that another "
            "window loses nothing; 8: only in 8 bits, about half the size",
        ),
        bounds=COUNT_OR_NONE,
    )
    without_vdb: bool = setting(
        False,
        "write no .vdb files: other programs draw no volumes, and another window starts from the "
        "voxels in 8 bits",
        flag=Flag(
            "--without-vdb",
            "write a small stage without .vdb files: bundle and viewer keep their volumes, other "
            "programs draw only surfaces; implies --bits 8",
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
        "channel = iso-value of its surface: a voxel value, or one above the background such as "
        "162+b; without: found by the build",
        flag=Flag(
            "--iso-value",
            "iso-value of a channel's surface: a voxel value, or one above the background such as "
            "162+b; the channel is a name, an index, or * for all others; may be repeated",
            "CHANNEL=VALUE",
        ),
    )
    surfaces: Mapping[str, str] = setting(
        {},
        "channel = surfaces to build: outer, inner, third, or voxel values, separated by commas; a "
        "value above the background such as 162+b; or none",
        flag=Flag(
            "--surfaces",
            "surfaces to build of a channel: outer, inner, third, or voxel values, separated by "
            "commas; or none; may be repeated",
            "CHANNEL=SURFACE,...",
        ),
    )
    windows: Mapping[str, str] = setting(
        {},
        "channel = LOW:HIGH, voxel values that are drawn darkest and brightest, or brain, bone, "
        "lung, soft (CT)",
        flag=Flag(
            "--window",
            "voxel values of a channel that are drawn darkest and brightest, such as CT=-160:240, "
            "or a CT's window by name: brain, bone, lung, soft; * stands for all other channels; "
            "may be repeated",
            "CHANNEL=LOW:HIGH",
        ),
    )
    paint: Mapping[str, str] = setting(
        {},
        "channel or label map = channel whose intensity is painted on its surface",
        flag=Flag(
            "--paint",
            "paint the second channel's intensity on the first one's surface, such as CD31=MART1; "
            "may be repeated",
            "CHANNEL=CHANNEL",
        ),
    )

    labels: Mapping[str, str] = setting(
        {},
        "label maps whose objects are built: name = path; an empty path means one of the input's "
        "own labels, . the input itself",
        flag=Flag(
            "--labels",
            "build the objects of a label map: NAME of one of the input's own, NAME=PATH, or . if "
            "the input itself is one; may be repeated",
            "NAME[=PATH]",
        ),
    )

    def __post_init__(self) -> None:
        for channel, value in self.iso_values.items():
            parse_level(f"iso_values.{channel}", value)
        for channel, window in self.windows.items():
            parse_window(f"windows.{channel}", window)


# Words for the type that a setting needs, by pydantic's type of error
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
    where: str = COMMAND_LINE,
) -> Settings:
    """Return the settings of a preset, a TOML file and flags; later ones override earlier ones.

    preset  name or TOML file of a preset; None: the defaults
    config  TOML file; None: none
    flags   values nested like the TOML: {"plan": {"level": 1}}
    where   name for the flags in messages

    Raises UsageError for unknown keys and wrong values.

    >>> load("ct", None, flags={"plan": {"level": 1}}).iso_values
    {'*': -300.0}
    """
    settings = Settings()
    if preset not in (None, NO_PRESET):
        settings = _apply_file(settings, preset_path(preset), f"preset {preset}")
    if config is not None:
        settings = _apply_file(settings, config, str(config))
    return apply(settings, flags, where)


def _apply_file(settings: Settings, path: Path, where: str) -> Settings:
    """Return the settings overridden by a file's. Raises UsageError, which names the file."""
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
    """Return the file of a preset: one of StereoCell's by name, or the user's own TOML file."""
    if preset.endswith(".toml"):
        return Path(preset)
    if preset not in preset_names():
        known = ", ".join(preset_names())
        raise UsageError(f"preset {preset!r} is unknown, expected one of {known} or a .toml file")
    return PRESETS / f"{preset}.toml"


def apply(settings: Settings, values: Mapping[str, Any], where: str) -> Settings:
    """Return the settings overridden by `values` ({section: {key: value}}).

    where  name for the values in messages

    Names of earlier versions are read, and a line is printed on each. Raises UsageError for unknown
    keys and wrong values.
    """
    values, lines = with_present_names(values, where)
    print_earlier_names(lines)
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
            merged["plan"]["grid"] = ""  # a later tile size replaces an earlier grid
        merged[section] |= content
    return _validate(merged, where)


def _validate(content: Mapping[str, Any], where: str) -> Settings:
    """Return settings from plain values, each with its field's type. Raises UsageError.

    pydantic's strict mode for JSON accepts a whole number as a number, a list as a tuple and a
    table as a dataclass, and converts nothing else.
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
    # The fault may lie in one value of a list. A union has one fault for each of its types.
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
    """Return settings from the output of `to_dict`, of this version or an earlier one."""
    where = "plan.json: settings"
    return apply(Settings(), with_present_names(values, where)[0], where)


def to_toml(settings: Settings, *, header: str = RECORD) -> str:
    """Return all settings as TOML, each with its comment, below a header in comments."""
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
    """Return the settings as TOML. Raises UsageError if `load` would read them differently."""
    text = to_toml(settings)
    if apply(Settings(), tomllib.loads(text), SETTINGS) != settings:
        raise UsageError(
            f"{SETTINGS}: these settings can't be written, because they would be read as others"
        )
    return text


def _toml(value: Any) -> str:
    if isinstance(value, str):
        # a TOML string is a JSON string, except that DEL must be escaped
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
                f"{path}: found {len(content)} bytes or more, and a line of {longest}, expected "
                f"settings of at most {_MAX_BYTES} bytes, with lines of at most {_MAX_LINE}"
            )
        return tomllib.loads(content.decode())
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}, expected a TOML file of settings") from None
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise UsageError(
            f"{path}: line {line}: found byte 0x{content[error.start]:02x}, expected UTF-8: save "
            "the file as UTF-8"
        ) from None
    except (ValueError, RecursionError) as error:  # ValueError: invalid TOML, or too large a number
        raise UsageError(f"{path}: this is not TOML: {error!s:.200}") from None


def _known(key: str, known: list[str], where: str, what: str) -> None:
    if key in known:
        return
    near = get_close_matches(key, known, 1)
    hint = f"did you mean {near[0]!r}?" if near else f"expected one of {', '.join(known)}"
    raise UsageError(f"{where}: unknown {what} {key!r:.80}; {hint}")
