"""The flags of each command, and what they say as settings."""

import argparse
import re
from collections.abc import Iterator, Mapping
from dataclasses import Field
from functools import partial
from pathlib import Path
from typing import Any, get_args, get_origin
from urllib.parse import unquote

from stereocell.model.errors import UsageError
from stereocell.model.settings import AUTO, Flag
from stereocell.model.titles import MAX_TITLE
from stereocell.storage.processes import cores


def declare_input(parser: argparse.ArgumentParser) -> None:
    """Declare what is read, and the OUT folder that is written."""
    declare_source(parser)
    _declare_title(parser)
    parser.add_argument(
        "-o", "--out", type=_place, required=True, help="folder of the results, or s3:// address"
    )


def _declare_title(parser: Any) -> None:
    parser.add_argument(
        "--title",
        type=_title,
        metavar="TEXT",
        help="name of the specimen in stage and page (default: by the source)",
    )


def _title(text: str) -> str:
    if not text.strip() or not text.isprintable() or len(text) > MAX_TITLE:
        raise argparse.ArgumentTypeError(
            f"{text!r:.40} is no title, expected 1 to {MAX_TITLE} printable characters"
        )
    return text.strip()


def declare_slices(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `slices`."""
    declare_source(parser)
    parser.add_argument("-o", "--out", type=_place, required=True, help="folder of the pictures")
    parser.add_argument(
        "--plane",
        choices=["acquired", "axial", "coronal", "sagittal", "xy", "xz", "yz"],
        default="acquired",
        help="which planes: as the source's own images lie (default), of a patient axial, coronal "
        "or sagittal, of microscopy xy, xz or yz",
    )


def declare_source(parser: argparse.ArgumentParser) -> None:
    """Declare INPUT and how it is read: series, channels, spacing, time."""
    parser.add_argument(
        "input",
        type=_named,
        help="a path: OME-Zarr, TIFF, DICOM (a folder or a file), NIfTI, a folder of planes (TIFF, "
        "PNG, JPEG, BMP), Imaris, HDF5 (FILE.h5:/KEY), netCDF, MATLAB 7.3, NRRD, MRC, MGH, CZI, "
        "...; or an http(s):// or s3:// address of OME-Zarr, TIFF or N5",
    )
    declare_how_to_read(parser)


def declare_how_to_read(parser: argparse.ArgumentParser) -> None:
    """Declare how a source is read and what is built of it: preset, channels, spacing, time."""
    declare_settings(parser)
    plan = parser.add_argument_group("what to build")
    for flag, _, field in _settings():
        declare_setting(plan, flag, field)


def declare_setting(parser: Any, flag: Flag, field: Field[Any]) -> None:
    """Declare a setting's flag, whose text becomes the setting's type."""
    about = {"help": (flag.help or field.metadata["comment"]).replace("%", "%%")}
    kind = field.type
    if kind is bool:
        # A preset or a file may turn a setting on, and `--no-dark` turns it off again.
        action = argparse.BooleanOptionalAction
        parser.add_argument(flag.name, action=action, default=None, **about)
    elif get_origin(kind) is Mapping:
        read = partial(_pair, flag, get_args(kind)[1])
        parser.add_argument(flag.name, action="append", metavar=flag.form, type=read, **about)
    elif get_origin(kind) is tuple:
        parser.add_argument(flag.name, type=partial(_listed, flag, get_args(kind)[0]), **about)
    elif flag.name == "--series":
        parser.add_argument(flag.name, metavar=flag.form, type=_series, **about)
    else:
        read_one = partial(_number_or_auto, get_args(kind)[0]) if get_args(kind) else kind
        parser.add_argument(flag.name, type=read_one, **about)


def _settings() -> Iterator[tuple[Flag, tuple[str, ...], Field[Any]]]:
    """Yield each setting that has a flag: the flag, the section and key, the field."""
    from stereocell.planning.setting_names import flagged_settings

    return flagged_settings()


def as_typed(options: argparse.Namespace, line: str) -> str:
    """Return an error's line with flags in place of the settings that were given by them."""
    if not hasattr(options, "spacing_um"):  # a command without a source
        return line
    from stereocell.planning.setting_names import in_flags

    return in_flags(line, given_flags(options))


def given_flags(options: argparse.Namespace) -> list[str]:
    """Return the flags, among those that say how a source is read and built, that were given."""
    names = ["--preset", "--config", *(flag.name for flag, _, _ in _settings())]
    return [name for name in names if getattr(options, _attribute(name)) is not None]


def _attribute(flag: str) -> str:
    return flag.removeprefix("--").replace("-", "_")


def declare_workers(parser: argparse.ArgumentParser) -> None:
    """Declare where tasks run: worker processes, or the address of a cluster."""
    parser.add_argument(
        "--workers",
        type=_worker_count,
        default="cores",  # counted only where it is not given
        help="worker processes; 0 runs inline (default: the cores that it may run on)",
    )
    parser.add_argument(
        "--scheduler",
        default="",
        metavar="ADDRESS|FILE",
        help="a running Dask cluster instead: tls://host:8786, or its scheduler file",
    )


def declare_out(parser: argparse.ArgumentParser) -> None:
    """Declare OUT, an existing build."""
    parser.add_argument("out", type=_place, help="folder of a build, or its s3:// address")


def _place(text: str) -> Path | str:
    """Return a local path, or an address as it is."""
    scheme, mark, path = _named(text).partition("://")
    if not mark:
        return Path(text)
    return Path(unquote(path)) if scheme == "file" else text


def _named(text: str) -> str:
    """Return a name as it is; an empty one would mean the folder in which the command runs."""
    if not text:
        raise argparse.ArgumentTypeError(
            "is empty, as a variable that is not set: expected a name (. is this folder)"
        )
    scheme, mark, place = text.partition("://")
    if mark and not (place if scheme == "file" else place.strip("/")):
        raise argparse.ArgumentTypeError(
            f"is {text!r}: expected a place behind it, as {scheme}://bucket/specimen"
        )
    return text


def _file(text: str) -> Path:
    return Path(_named(text))


def _worker_count(text: str) -> int:
    return cores() if text == "cores" else _count(text)


def _count(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least 0")
    return int(text)


def _port(text: str) -> int:
    if not text.isdecimal() or int(text) > 0xFFFF:
        raise argparse.ArgumentTypeError(f"{text!r} is no port, expected 0 to 65535")
    return int(text)


def _origin(text: str) -> str:
    found = re.fullmatch(r"https?://[a-z0-9.-]+(:\d{1,5})?", text.rstrip("/"), re.IGNORECASE)
    if found is None:
        raise argparse.ArgumentTypeError(
            f"{text!r} is no origin, expected a scheme and a host, such as https://lab.example"
        )
    return found.group().lower()


def _number_or_auto(kind: type[int] | type[float], text: str) -> float | str:
    try:
        return text if text == AUTO else kind(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"invalid {kind.__name__} value: {text!r}") from None


def _series(text: str) -> int | str:
    if text == "list":
        return text
    if not text.isdecimal() or int(text) < 1:
        raise UsageError(f"--series is {text!r}, expected a number from 1, or `list` to see them")
    return int(text)


def _listed(flag: Flag, kind: type, text: str) -> list[Any]:
    """Return the values between commas: names, or three numbers."""
    if kind is not str:
        return numbers(text, kind, flag.name)
    values = [value.strip() for value in text.split(",")]
    if not all(values):
        raise UsageError(f"{flag.name} is {text!r}, expected {flag.form}")
    return values


def numbers(text: str, kind: type[int] | type[float], flag: str) -> list[Any]:
    """Return three numbers between commas. Raises UsageError."""
    try:
        values = [kind(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3:
        raise UsageError(f"{flag} is {text!r}, expected three numbers z,y,x")
    return values


def _pair(flag: Flag, kind: type, text: str) -> tuple[str, Any]:
    """Return a channel and what is given for it."""
    if flag.form.endswith("[=PATH]"):  # a path may hold anything
        name, _, value = text.partition("=")
        if not name or text.endswith("="):
            raise UsageError(f"{flag.name} is {text!r}, expected {flag.form}")
        return name, value
    name, _, value = text.rpartition("=")
    try:
        given = kind(value) if isinstance(kind, type) else _number_or_text(value)
    except ValueError:
        given = ""
    if not name or given == "":
        example = ", as CD31=MART1" if flag.form == "CHANNEL=CHANNEL" else ""
        raise UsageError(f"{flag.name} is {text!r}, expected {flag.form}{example}")
    return name, given


def _number_or_text(text: str) -> float | str:
    """Return a number, or a text of a number and more, as 162+b. Raises ValueError."""
    number, plus, more = text.partition("+")
    return text if float(number) == float(number) and plus and more else float(text)


def flags_of(options: argparse.Namespace) -> dict[str, Any]:
    """Return the flags as the TOML's sections and keys. Raises UsageError."""
    if options.grid is not None and options.tile_size is not None:
        raise UsageError("--grid and --tile-size both say how to cut, expected one of them")
    given: dict[str, Any] = {}
    for flag, place, _ in _settings():
        value = getattr(options, _attribute(flag.name))
        if value is None:
            continue
        section = given.setdefault(place[0], {})
        if len(place) == 2:
            section[place[1]] = value
            continue
        for channel, one in value:
            if channel in section:
                raise UsageError(f"{flag.name} names channel {channel!r} twice, expected once")
            section[channel] = one
    return given


def declare_settings(parser: argparse.ArgumentParser) -> None:
    """Declare presets, the settings file and a flag a setting."""
    from stereocell.planning.settings import preset_names

    presets = ", ".join(preset_names())
    parser.add_argument(
        "--preset", help=f"{presets}, none, or a TOML file of your own (default: by the input)"
    )
    parser.add_argument("--config", type=_file, help="settings (see `stereocell settings`)")


def declare_build(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `build`."""
    declare_input(parser)
    declare_workers(parser)


def declare_iso(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `iso`."""
    declare_source(parser)
    parser.add_argument("--channel", required=True, metavar="X", help="by name or index, as CD31")
    parser.add_argument("--tile", required=True, help="as a build names it: r0_c0")
    parser.add_argument(
        "-o", "--out", type=_place, metavar="PNG", help="default: iso_CHANNEL_TILE.png here"
    )


def declare_units(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `units`."""
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument("--only", metavar="TILE/CHANNEL", help="build one unit, as r0_c3/CD31")


def declare_stage(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `stage`."""
    declare_out(parser)
    declare_workers(parser)


def declare_bundle(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `bundle`."""
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument("--stage", type=_file, help="an edited stage, instead of OUT/stage")
    parser.add_argument(
        "--strict",
        action="store_true",
        help="write nothing, and fail, where an edit is not taken over",
    )


def declare_check(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `check`."""
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument(
        "--deep",
        action="store_true",
        help="also hold the stage against its source, and the bundle against the stage",
    )
    parser.add_argument(
        "--stage", type=_file, help="what the bundle was exported from, instead of OUT/stage"
    )


def declare_tissue(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `tissue`."""
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument(
        "--classes", metavar="N|auto", help="how many (default auto: by the volume itself)"
    )
    parser.add_argument(
        "--channel", default="", metavar="X", help="learn from this one, by name or index"
    )
    parser.add_argument(
        "--model", type=_file, metavar="FILE.onnx", help="a network of your own (docs/tissue.md)"
    )
    parser.add_argument(
        "--model-seconds",
        type=float,
        default=300,
        metavar="S",
        help="longest time for one patch of the network, in s (default %(default)s)",
    )
    parser.add_argument(
        "--model-memory-gb",
        type=float,
        default=4,
        metavar="GB",
        help="most memory for the network, in GB (default %(default)s)",
    )
    parser.add_argument(
        "--everywhere",
        action="store_true",
        help="learn in all that isn't background; by default in MR inside the brain alone",
    )


def declare_sample(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `sample`."""
    parser.add_argument("name", choices=["cycif", "brain-cells", "mri", "cells"])
    parser.add_argument("out", type=_place, metavar="OUT", help="file or folder to write")
    parser.add_argument(
        "--seed", type=int, default=0, help="cycif, mri: another seed, another block or noise"
    )
    cycif = parser.add_argument_group("cycif")
    cycif.add_argument(
        "--grid", default="5x2", help="columns x rows of tiles (default %(default)s)"
    )
    cycif.add_argument("--tile-size", default="48,96,96", help="z,y,x (default %(default)s)")
    cycif.add_argument(
        "--brightness-spread", type=float, default=1.0, help="cells are up to 1 + this as bright"
    )


def declare_view(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `view`: those of `serve`, and the browser."""
    declare_serve(parser)
    parser.add_argument("--no-browser", action="store_true", help="don't open a browser")


def declare_serve(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `serve`."""
    parser.add_argument(
        "out",
        type=_place,
        nargs="?",
        metavar="OUT|SOURCE",
        help="folder of a build, or its s3:// address; or a source: all that `build` takes",
    )
    parser.add_argument("--port", type=_port, default=8000, help="default 8000; 0: any free one")
    parser.add_argument(
        "--lan",
        action="store_true",
        help="also for phones in this network: TLS, and a QR code that lets one device in",
    )
    parser.add_argument(
        "--allow-frame",
        type=_origin,
        action="append",
        default=[],
        metavar="ORIGIN",
        help="a page of this origin (https://lab.example) may hold the viewer in a frame; may be "
        "given several times",
    )
    inbox = parser.add_argument_group("an inbox, without OUT|SOURCE")
    inbox.add_argument(
        "--inbox",
        type=_file,
        metavar="FOLDER",
        help="a page on which people hand in files or an address, look, and build; FOLDER keeps "
        "uploads and builds (docs/inbox.md)",
    )
    inbox.add_argument(
        "--inbox-gb",
        type=_positive,
        metavar="GB",
        help="largest upload, in GB, and what its archive unpacks to (default 50)",
    )
    behind = parser.add_argument_group("a source")
    behind.add_argument(
        "--no-build", action="store_true", help="only look: don't build the source behind the page"
    )
    behind.add_argument(
        "-o",
        "--out",
        dest="build_out",
        type=_file,
        metavar="OUT",
        help="folder of the build (default: NAME.stereocell here, by the specimen's name; beside "
        "the source where that is the working folder)",
    )
    _declare_title(behind)
    declare_how_to_read(parser)


def declare_export(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `export`."""
    declare_out(parser)
    parser.add_argument("file", type=_file, metavar="FILE", help="what to write, by its ending")
    parser.add_argument("--channels", type=_names, default=(), metavar="A,B", help="these alone")
    parser.add_argument(
        "--tiles", type=_names, default=(), metavar="r0_c0,r0_c1", help="these alone"
    )
    parser.add_argument("--region", metavar="x0:x1,y0:y1,z0:z1", help="in um, as the stage has it")
    parser.add_argument("--stage", type=_file, help="an edited stage, instead of OUT/stage")
    parser.add_argument(
        "--strict",
        action="store_const",
        const=True,
        help="write nothing, and fail, where an edit is left out",
    )
    surfaces = parser.add_argument_group("surfaces")
    surfaces.add_argument("--lod", type=_count, help="level of detail (default 0: the finest)")
    surfaces.add_argument(
        "--max-triangles", type=_count, metavar="N", help="the finest level of at most as many"
    )
    surfaces.add_argument(
        "--max-bytes", type=_count, metavar="N", help="the finest level whose file is no larger"
    )
    surfaces.add_argument(
        "--scale",
        type=_positive,
        help="times the specimen (default: life-size; in .usdz and print the size of a hand)",
    )
    surfaces.add_argument(
        "--units",
        choices=["um", "mm", "m"],
        help="of the numbers in .stl .3mf .ply .obj .nrrd .nii .raw (default mm)",
    )
    surfaces.add_argument(
        "--wall-mm",
        type=_positive,
        metavar="MM",
        help="name what is thinner in print (default 0.8)",
    )
    surfaces.add_argument(
        "--compress", choices=["meshopt", "draco"], help=".glb of a fifth, for fewer programs"
    )
    surfaces.add_argument(
        "--components",
        action="store_const",
        const=True,
        help="bodies of a .3mf stay objects, for mesh programs; PrusaSlicer moves them apart",
    )
    surfaces.add_argument(
        "--occlusion",
        action="store_const",
        const=True,
        help="vertices are darker where light is occluded; some programs show these alone",
    )

    surfaces.add_argument(
        "--width",
        type=_width,
        metavar="PIXELS",
        help="of .png (default 1600), .mp4 and .webm (640)",
    )
    volumes = parser.add_argument_group("volumes")
    volumes.add_argument(
        "--bits",
        type=int,
        choices=[8, 16],
        help="8: the channel's window; 16: the source's values (default: 16 where OUT has them)",
    )
    volumes.add_argument(
        "--unity",
        action="store_const",
        const=True,
        help="one channel in .raw or .nrrd, upright, as UnityVolumeRendering reads it",
    )
    pages = parser.add_argument_group("a page in one file, .html")
    pages.add_argument(
        "--max-mb",
        type=_positive,
        metavar="MB",
        help="the finest levels of surfaces and volumes that fit are taken (default 25)",
    )
    pages.add_argument(
        "--view", metavar="LINK", help="a link that the viewer has made: how the page opens"
    )


def declare_publish(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `publish`."""
    declare_out(parser)
    parser.add_argument(
        "target",
        type=_named,
        metavar="TARGET",
        help="a folder, or an address, as s3://bucket/specimen",
    )
    parser.add_argument(
        "--url",
        help="https:// address at which browsers find TARGET: every file is fetched from there, "
        "and a link and a QR code are printed (default: S3's own)",
    )
    parser.add_argument(
        "--private",
        action="store_true",
        help="do not ask S3 to let everybody read it (ACL public-read): a policy does, or nobody",
    )


def _width(text: str) -> int:
    if not text.isdecimal() or not 64 <= int(text) <= 8192:
        raise argparse.ArgumentTypeError(f"{text!r} is no width, expected 64 to 8192")
    return int(text)


def _names(text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise argparse.ArgumentTypeError(f"{text!r} has an empty name")
    return names


def _positive(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is no number above 0")
    return number


def declare_nothing(_: argparse.ArgumentParser) -> None:
    """A command without flags of its own."""
