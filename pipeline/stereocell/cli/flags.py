"""The flags of each command, and what they say as settings."""

import argparse
from collections.abc import Container
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from stereocell.storage.processes import cores


def declare_input(parser: argparse.ArgumentParser) -> None:
    declare_source(parser)
    parser.add_argument(
        "-o", "--out", type=_place, required=True, help="folder of the results, or s3:// address"
    )


def declare_slices(parser: argparse.ArgumentParser) -> None:
    declare_source(parser)
    parser.add_argument("-o", "--out", type=_place, required=True, help="folder of the pictures")


def declare_source(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "input",
        help="OME-Zarr or OME-TIFF: a path, http(s):// or s3:// address; DICOM (a folder or a "
        "file) or NIfTI: a path",
    )
    parser.add_argument("--preset", help="cycif, lightsheet, mri, or a TOML file of your own")
    parser.add_argument("--config", type=Path, help="settings (see `stereocell settings`)")
    plan = parser.add_argument_group("what to build")
    plan.add_argument("--level", type=int, help="resolution level, 0 is the finest")
    plan.add_argument("--channels", help="names or indices, as CD31,MART1")
    plan.add_argument(
        "--region",
        help="z0:z1,y0:y1,x0:x1 in voxels of the level that is built: without --level the finest "
        "whose region stays within plan.max_voxels",
    )
    plan.add_argument("--tile-size", help="z,y,x in voxels")
    plan.add_argument("--grid", help="columns x rows of equal tiles, as 5x2; not with --tile-size")
    plan.add_argument("--time", type=int, help="index into a time series")
    plan.add_argument(
        "--series",
        metavar="N|list",
        help="which series of a DICOM folder (default: the largest); `list` shows them and does "
        "nothing else",
    )
    plan.add_argument("--spacing-um", help="z,y,x voxel spacing in um, instead of the file's")
    plan.add_argument(
        "--iso-criterion", help="how iso-values are found: edges (default), adaptive, ..."
    )
    plan.add_argument(
        "--wrap", help="how gaps are closed: voxels (default), alpha-wrap (pymeshlab, one tile)"
    )
    plan.add_argument(
        "--closed-tiles",
        action="store_const",
        const=True,
        help="also a closed STL of every tile and channel, for printing and booleans",
    )
    plan.add_argument(
        "--iso-value",
        action="append",
        metavar="CHANNEL=VALUE",
        help="use this iso-value (voxel values) for a channel, by name or index; may be repeated",
    )
    plan.add_argument(
        "--paint",
        action="append",
        metavar="CHANNEL=CHANNEL",
        help="paint the second channel's intensity on the first one's surface, as CD31=MART1; "
        "may be repeated",
    )


def declare_workers(parser: argparse.ArgumentParser) -> None:
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
        help="a running Dask cluster instead: tcp://host:8786, or its scheduler file",
    )


def declare_out(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("out", type=_place, help="folder of a build, or its s3:// address")


def _place(text: str) -> Path | str:
    """Return a local path, or an address as it is."""
    scheme, mark, path = text.partition("://")
    if not mark:
        return Path(text)
    return Path(unquote(path)) if scheme == "file" else text


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


def numbers(text: str, kind: type[int] | type[float], flag: str) -> list[Any]:
    from stereocell.model.errors import UsageError

    try:
        values = [kind(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3:
        raise UsageError(f"{flag} is {text!r}, expected three numbers z,y,x")
    return values


def _once(flag: str, name: str, given: Container[str]) -> None:
    from stereocell.model.errors import UsageError

    if name in given:
        raise UsageError(f"{flag} names channel {name!r} twice, expected once")


def flags_of(options: argparse.Namespace) -> dict[str, Any]:
    """Return the flags as the TOML's sections and keys."""
    from stereocell.model.errors import UsageError

    if options.grid is not None and options.tile_size is not None:
        raise UsageError("--grid and --tile-size both say how to cut, expected one of them")
    plan: dict[str, Any] = {}
    for key in ("level", "region", "grid", "time"):
        if getattr(options, key) is not None:
            plan[key] = getattr(options, key)
    if options.series is not None:
        if not options.series.isdecimal() or int(options.series) < 1:
            raise UsageError(
                f"--series is {options.series!r}, expected a number from 1, or `list` to see them"
            )
        plan["series"] = int(options.series)
    if options.channels is not None:
        plan["channels"] = [name.strip() for name in options.channels.split(",")]
        if not all(plan["channels"]):
            raise UsageError(
                f"--channels is {options.channels!r}, expected names or indices, as CD31,MART1"
            )
    if options.tile_size is not None:
        plan["tile_size"] = numbers(options.tile_size, int, "--tile-size")
    if options.spacing_um is not None:
        plan["spacing_um"] = numbers(options.spacing_um, float, "--spacing-um")
    iso_values: dict[str, float] = {}
    for text in options.iso_value or []:
        name, _, value = text.rpartition("=")
        try:
            number = float(value)
        except ValueError:
            name = ""
        if not name:
            raise UsageError(f"--iso-value is {text!r}, expected CHANNEL=VALUE")
        _once("--iso-value", name, iso_values)
        iso_values[name] = number
    paint: dict[str, str] = {}
    for text in options.paint or []:
        name, _, painted = text.rpartition("=")
        if not name or not painted:
            raise UsageError(f"--paint is {text!r}, expected CHANNEL=CHANNEL, as CD31=MART1")
        _once("--paint", name, paint)
        paint[name] = painted
    isovalue = {} if options.iso_criterion is None else {"criterion": options.iso_criterion}
    surface = {
        key: getattr(options, key)
        for key in ("wrap", "closed_tiles")
        if getattr(options, key) is not None
    }
    return {
        "plan": plan,
        "isovalue": isovalue,
        "surface": surface,
        "iso_values": iso_values,
        "paint": paint,
    }


def declare_settings(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--preset", help="cycif, lightsheet, mri, or a TOML file of your own")
    parser.add_argument("--config", type=Path, help="a TOML file of settings")


def declare_build(parser: argparse.ArgumentParser) -> None:
    declare_input(parser)
    declare_workers(parser)


def declare_iso(parser: argparse.ArgumentParser) -> None:
    declare_source(parser)
    parser.add_argument("--channel", required=True, metavar="X", help="by name or index, as CD31")
    parser.add_argument("--tile", required=True, help="as a build names it: r0_c0")
    parser.add_argument(
        "-o", "--out", type=_place, metavar="PNG", help="default: iso_CHANNEL_TILE.png here"
    )


def declare_units(parser: argparse.ArgumentParser) -> None:
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument("--only", metavar="TILE/CHANNEL", help="build one unit, as r0_c3/CD31")


def declare_stage(parser: argparse.ArgumentParser) -> None:
    declare_out(parser)
    declare_workers(parser)


def declare_bundle(parser: argparse.ArgumentParser) -> None:
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument("--stage", type=Path, help="an edited stage, instead of OUT/stage")


def declare_check(parser: argparse.ArgumentParser) -> None:
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument(
        "--deep",
        action="store_true",
        help="also hold the stage against its source, and the bundle against the stage",
    )
    parser.add_argument(
        "--stage", type=Path, help="what the bundle was exported from, instead of OUT/stage"
    )


def declare_tissue(parser: argparse.ArgumentParser) -> None:
    declare_out(parser)
    declare_workers(parser)
    parser.add_argument(
        "--classes", metavar="N|auto", help="how many (default auto: by the volume itself)"
    )
    parser.add_argument(
        "--channel", default="", metavar="X", help="learn from this one, by name or index"
    )
    parser.add_argument(
        "--model", type=Path, metavar="FILE.onnx", help="a network of your own (docs/tissue.md)"
    )
    parser.add_argument(
        "--everywhere",
        action="store_true",
        help="learn in all that isn't background; by default in MR inside the brain alone",
    )


def declare_sample(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", choices=["cycif", "brain-cells", "mri"])
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
    declare_serve(parser)
    parser.add_argument("--no-browser", action="store_true", help="don't open a browser")


def declare_serve(parser: argparse.ArgumentParser) -> None:
    declare_out(parser)
    parser.add_argument("--port", type=_port, default=8000, help="default 8000; 0: any free one")
    parser.add_argument(
        "--lan",
        action="store_true",
        help="also for phones in this network: TLS, and a QR code that lets one device in",
    )


def declare_nothing(_: argparse.ArgumentParser) -> None:
    """A command without flags of its own."""
