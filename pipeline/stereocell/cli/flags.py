"""Declare the flags of each command, and turn them into settings."""

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

NUMBERS = {int: "whole number", float: "number"}


def declare_input(parser: argparse.ArgumentParser) -> None:
    """Declare INPUT, how it is read, and OUT."""
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
        help="name of the specimen in the stage and the page (default: the name of the source)",
    )


def _title(text: str) -> str:
    if not text.strip() or not text.isprintable() or len(text) > MAX_TITLE:
        raise argparse.ArgumentTypeError(
            f"{text!r:.40} is not a title, expected 1 to {MAX_TITLE} printable characters"
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
        help="planes to write: those of the source's own images (default); axial, coronal or "
        "sagittal of a patient; xy, xz or yz of microscopy",
    )


def declare_source(parser: argparse.ArgumentParser) -> None:
    """Declare INPUT and how it is read and built."""
    parser.add_argument(
        "input",
        type=_named,
        help="path of a volume: OME-Zarr, TIFF, DICOM, NIfTI, a folder of planes (TIFF, PNG, ...), "
        "Imaris, HDF5 (FILE.h5:/KEY), netCDF, MATLAB 7.3, NRRD, MRC, MGH, CZI and others "
        "(docs/input-formats.md); or an address (http, https, s3) of OME-Zarr, TIFF or N5",
    )
    declare_how_to_read(parser)


def declare_how_to_read(parser: argparse.ArgumentParser) -> None:
    """Declare how a source is read and built: preset, channels, spacing, time."""
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
    """Return an error's line in which settings that came from flags are named by their flags."""
    if not hasattr(options, "spacing_um"):  # the command reads no source
        return line
    from stereocell.planning.setting_names import in_flags

    return in_flags(line, given_flags(options))


def given_flags(options: argparse.Namespace) -> list[str]:
    """Return the given flags that say how a source is read and built."""
    names = ["--preset", "--config", *(flag.name for flag, _, _ in _settings())]
    return [name for name in names if getattr(options, _attribute(name)) is not None]


def _attribute(flag: str) -> str:
    return flag.removeprefix("--").replace("-", "_")


def declare_workers(parser: argparse.ArgumentParser) -> None:
    """Declare where tasks run: worker processes, or the address of a cluster."""
    parser.add_argument(
        "--workers",
        type=_worker_count,
        default="cores",  # counted later, and only if the flag is not given
        help="number of worker processes; 0 uses this process (default: the number of cores)",
    )
    parser.add_argument(
        "--scheduler",
        default="",
        metavar="ADDRESS|FILE",
        help="use a running Dask cluster: tls://host:8786, or its scheduler file",
    )


def declare_out(parser: argparse.ArgumentParser) -> None:
    """Declare OUT, the folder of a build that exists."""
    parser.add_argument("out", type=_place, help="folder of a build, or its s3:// address")


def _place(text: str) -> Path | str:
    """Return a local path, or an address unchanged."""
    scheme, mark, path = _named(text).partition("://")
    if not mark:
        return Path(text)
    return Path(unquote(path)) if scheme == "file" else text


def _named(text: str) -> str:
    """Return a name unchanged, and refuse an empty one, which would mean the working folder."""
    if not text:
        raise argparse.ArgumentTypeError(
            "is empty, perhaps because a variable is not set, expected a name (. is this folder)"
        )
    scheme, mark, place = text.partition("://")
    if mark and not (place if scheme == "file" else place.strip("/")):
        raise argparse.ArgumentTypeError(
            f"is {text!r}, expected more behind it, such as {scheme}://bucket/specimen"
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
        raise argparse.ArgumentTypeError(f"{text!r} is not a port, expected 0 to 65535")
    return int(text)


def _origin(text: str) -> str:
    found = re.fullmatch(r"https?://[a-z0-9.-]+(:\d{1,5})?", text.rstrip("/"), re.IGNORECASE)
    if found is None:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not an origin, expected a scheme and a host, such as https://lab.example"
        )
    return found.group().lower()


def _number_or_auto(kind: type[int] | type[float], text: str) -> float | str:
    try:
        return text if text == AUTO else kind(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a {NUMBERS[kind]}") from None


def _series(text: str) -> int | str:
    if text == "list":
        return text
    if not text.isdecimal() or int(text) < 1:
        raise UsageError(f"--series is {text!r}, expected a number from 1, or `list` to print them")
    return int(text)


def _listed(flag: Flag, kind: type, text: str) -> list[Any]:
    """Return the values of a list with commas: names, or three numbers."""
    if kind is not str:
        return numbers(text, kind, flag.name)
    values = [value.strip() for value in text.split(",")]
    if not all(values):
        raise UsageError(f"{flag.name} is {text!r}, expected {flag.form}")
    return values


def numbers(text: str, kind: type[int] | type[float], flag: str) -> list[Any]:
    """Return the three numbers of a list with commas. Raises UsageError."""
    try:
        values = [kind(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3:
        raise UsageError(f"{flag} is {text!r}, expected three numbers z,y,x")
    return values


def _pair(flag: Flag, kind: type, text: str) -> tuple[str, Any]:
    """Return a channel and the value given for it. Raises UsageError."""
    if flag.form.endswith("[=PATH]"):  # the path may contain any character, also `=`
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
        example = ", such as CD31=MART1" if flag.form == "CHANNEL=CHANNEL" else ""
        raise UsageError(f"{flag.name} is {text!r}, expected {flag.form}{example}")
    return name, given


def _number_or_text(text: str) -> float | str:
    """Return a number, or the text of a number above the background, such as 162+b.

    Raises ValueError for any other text.
    """
    number, plus, more = text.partition("+")
    return text if float(number) == float(number) and plus and more else float(text)


def flags_of(options: argparse.Namespace) -> dict[str, Any]:
    """Return the given flags as sections and keys of the settings. Raises UsageError."""
    if options.grid is not None and options.tile_size is not None:
        raise UsageError("--grid and --tile-size both set the size of tiles, expected one of them")
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
    """Declare --preset and --config."""
    from stereocell.planning.settings import preset_names

    presets = ", ".join(preset_names())
    parser.add_argument(
        "--preset", help=f"{presets}, none, or your own TOML file (default: chosen by the input)"
    )
    parser.add_argument(
        "--config", type=_file, help="TOML file of settings (see `stereocell settings`)"
    )


def declare_build(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `build`."""
    declare_input(parser)
    declare_workers(parser)


def declare_iso(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `iso`."""
    declare_source(parser)
    parser.add_argument(
        "--channel",
        required=True,
        metavar="X",
        help="channel, by its name or its index, such as CD31",
    )
    parser.add_argument(
        "--tile", required=True, help="tile, by the name that a build gives it, such as r0_c0"
    )
    parser.add_argument(
        "-o",
        "--out",
        type=_place,
        metavar="PNG",
        help="picture to write (default: iso_CHANNEL_TILE.png in this folder)",
    )


def declare_units(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `units`."""
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument(
        "--only",
        metavar="TILE/CHANNEL",
        help="build one channel of one tile alone, such as r0_c3/CD31",
    )


def declare_stage(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `stage`."""
    declare_out(parser)
    declare_workers(parser)


def declare_bundle(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `bundle`."""
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument("--stage", type=_file, help="an edited stage to use instead of OUT/stage")
    parser.add_argument(
        "--strict",
        action="store_true",
        help="fail, and write nothing, if an edit of the stage can't be taken over",
    )


def declare_report(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `report`."""
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument(
        "--texture-similarity",
        action="store_true",
        help="also compare pictures of a coarser level of detail with the finest, by SSIM, in up "
        "to three pairs of tile and channel; each takes 2 to 10 s",
    )


def declare_check(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `check`."""
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument(
        "--deep",
        action="store_true",
        help="also compare the stage with its source, and the bundle with the stage",
    )
    parser.add_argument(
        "--stage",
        type=_file,
        help="the stage that the bundle was exported from, if it is not OUT/stage",
    )


def declare_tissue(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `tissue`."""
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument(
        "--classes", metavar="N|auto", help="number of classes (default auto: found in the volume)"
    )
    parser.add_argument(
        "--channel", default="", metavar="X", help="channel to learn from, by its name or its index"
    )
    parser.add_argument(
        "--model",
        type=_file,
        metavar="FILE.onnx",
        help="your own network, used instead of learning (docs/tissue.md)",
    )
    parser.add_argument(
        "--model-seconds",
        type=float,
        default=300,
        metavar="S",
        help="longest time for loading the network, and for each patch, in s (default %(default)s)",
    )
    parser.add_argument(
        "--model-memory-gb",
        type=float,
        default=4,
        metavar="GB",
        help="largest memory that the network may use, in GB (default %(default)s)",
    )
    parser.add_argument(
        "--everywhere",
        action="store_true",
        help="learn the classes from all voxels but the background (default in MR: from the brain "
        "alone)",
    )


def declare_sample(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `sample`."""
    parser.add_argument("name", choices=["cycif", "brain-cells", "mri", "cells"])
    parser.add_argument("out", type=_place, metavar="OUT", help="file or folder to write")
    parser.add_argument(
        "--seed", type=int, default=0, help="seed of the random numbers of cycif, mri and cells"
    )
    cycif = parser.add_argument_group("cycif")
    cycif.add_argument(
        "--grid", default="5x2", help="columns x rows of tiles (default %(default)s)"
    )
    cycif.add_argument("--tile-size", default="48,96,96", help="z,y,x (default %(default)s)")
    cycif.add_argument(
        "--brightness-spread",
        type=float,
        default=1.0,
        help="cells are up to 1 + this times as bright as the darkest (default %(default)s)",
    )


def declare_view(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `view`: those of `serve`, and --no-browser."""
    declare_serve(parser)
    parser.add_argument("--no-browser", action="store_true", help="don't open a browser")


def declare_serve(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `serve`."""
    parser.add_argument(
        "out",
        type=_place,
        nargs="?",
        metavar="OUT|SOURCE",
        help="folder of a build, or its s3:// address; or a volume, as `build` reads it",
    )
    parser.add_argument(
        "--port",
        type=_port,
        default=8000,
        help="port of the server (default 8000; 0: any free port)",
    )
    parser.add_argument(
        "--lan",
        action="store_true",
        help="serve phones in this network too: TLS, and a QR code that lets one device in",
    )
    parser.add_argument(
        "--allow-frame",
        type=_origin,
        action="append",
        default=[],
        metavar="ORIGIN",
        help="let pages of this origin (https://lab.example) embed the viewer in a frame; can be "
        "given several times",
    )
    inbox = parser.add_argument_group("an inbox, in place of OUT|SOURCE")
    inbox.add_argument(
        "--inbox",
        type=_file,
        metavar="FOLDER",
        help="serve a page on which people upload files or enter an address, look and build; "
        "FOLDER keeps uploads and builds (docs/inbox.md)",
    )
    inbox.add_argument(
        "--inbox-gb",
        type=_positive,
        metavar="GB",
        help="largest upload, packed and unpacked, in GB (default 50)",
    )
    behind = parser.add_argument_group("a volume that is not built")
    behind.add_argument(
        "--no-build", action="store_true", help="only show the volume, and build nothing meanwhile"
    )
    behind.add_argument(
        "-o",
        "--out",
        dest="build_out",
        type=_file,
        metavar="OUT",
        help="folder of the build (default: NAME.stereocell in this folder, by the specimen's "
        "name; beside the volume if this folder is the volume)",
    )
    _declare_title(behind)
    declare_how_to_read(parser)


def declare_export(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `export`."""
    declare_out(parser)
    parser.add_argument(
        "file", type=_file, metavar="FILE", help="file to write; its ending chooses the format"
    )
    parser.add_argument(
        "--channels", type=_names, default=(), metavar="A,B", help="write these channels alone"
    )
    parser.add_argument(
        "--tiles", type=_names, default=(), metavar="r0_c0,r0_c1", help="write these tiles alone"
    )
    parser.add_argument(
        "--region",
        metavar="x0:x1,y0:y1,z0:z1",
        help="write this box alone, in um of the stage: x first, y upwards. The --region of "
        "`build` is in voxels instead, z first",
    )
    parser.add_argument("--stage", type=_file, help="an edited stage to use instead of OUT/stage")
    parser.add_argument(
        "--strict",
        action="store_const",
        const=True,
        help="fail, and write nothing, if an edit of the stage would be left out",
    )
    surfaces = parser.add_argument_group("surfaces")
    surfaces.add_argument("--lod", type=_count, help="level of detail (default 0: the finest)")
    surfaces.add_argument(
        "--max-triangles",
        type=_count,
        metavar="N",
        help="use the finest level of detail of at most this many triangles",
    )
    surfaces.add_argument(
        "--max-bytes",
        type=_count,
        metavar="N",
        help="use the finest level of detail whose file has at most this many bytes",
    )
    surfaces.add_argument(
        "--scale",
        type=_positive,
        help="factor by which the specimen is enlarged (default: 1; in .usdz and in files for "
        "printers it becomes the size of a hand)",
    )
    surfaces.add_argument(
        "--units",
        choices=["um", "mm", "m"],
        help="unit of lengths in .stl .3mf .ply .obj .nrrd .nii .raw (default mm)",
    )
    surfaces.add_argument(
        "--wall-mm",
        type=_positive,
        metavar="MM",
        help="report walls that are thinner than this in print (default 0.8)",
    )
    surfaces.add_argument(
        "--compress",
        choices=["meshopt", "draco"],
        help="compress a .glb to about a fifth; fewer programs open it",
    )
    surfaces.add_argument(
        "--components",
        action="store_const",
        const=True,
        help="keep components of a .3mf as objects (PrusaSlicer moves them apart)",
    )
    surfaces.add_argument(
        "--occlusion",
        action="store_const",
        const=True,
        help="darken vertices that little light reaches; some programs show only these colours",
    )

    surfaces.add_argument(
        "--width",
        type=_width,
        metavar="PIXELS",
        help="width of .png (default 1600), .mp4 and .webm (640)",
    )
    volumes = parser.add_argument_group("volumes")
    volumes.add_argument(
        "--bits",
        type=int,
        choices=[8, 16],
        help="8: the display window; 16: the source's values (default: 16 if OUT has them)",
    )
    volumes.add_argument(
        "--unity",
        action="store_const",
        const=True,
        help="write one channel to .raw or .nrrd in the orientation of UnityVolumeRendering",
    )
    pages = parser.add_argument_group("a page in one file, .html")
    pages.add_argument(
        "--max-mb",
        type=_positive,
        metavar="MB",
        help="largest size of the page, which gets the finest surfaces and volumes that fit "
        "(default 25)",
    )
    pages.add_argument(
        "--view",
        metavar="LINK",
        help="a link copied from the viewer, whose view the page opens with",
    )


def declare_publish(parser: argparse.ArgumentParser) -> None:
    """Declare the flags of `publish`."""
    declare_out(parser)
    parser.add_argument(
        "target",
        type=_named,
        metavar="TARGET",
        help="a folder, or an address such as s3://bucket/specimen",
    )
    parser.add_argument(
        "--url",
        help="https:// address of TARGET for browsers; every file is fetched from it as a check, "
        "and a link and a QR code are printed (default: S3's own address)",
    )
    parser.add_argument(
        "--private",
        action="store_true",
        help="do not ask S3 to let everybody read the files (ACL public-read)",
    )


def _width(text: str) -> int:
    if not text.isdecimal() or not 64 <= int(text) <= 8192:
        raise argparse.ArgumentTypeError(f"{text!r} is not a width, expected 64 to 8192 pixels")
    return int(text)


def _names(text: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise argparse.ArgumentTypeError(
            f"{text!r} has an empty name, expected names with commas between them"
        )
    return names


def _positive(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        number = 0.0
    if not 0 < number < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number above 0")
    return number


def declare_nothing(_: argparse.ArgumentParser) -> None:
    """Declare nothing: the command has no flags of its own."""
