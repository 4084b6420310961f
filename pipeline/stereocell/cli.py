"""The command `stereocell`: one subcommand per phase, and one that runs them all."""

import argparse
import os
import sys
from collections.abc import Callable, Container, Sequence
from pathlib import Path
from typing import Any

from stereocell.errors import StereoCellError

Handler = Callable[[argparse.Namespace], int]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; return its exit code: 0, 1 for an error, 2 for wrong usage."""
    options = _parser().parse_args(arguments)
    try:
        code: int = options.handler(options)
        return code
    except StereoCellError as error:
        print(f"stereocell: {error}", file=sys.stderr)
        return error.exit_code
    except OSError as error:  # the disk is full, a folder was taken away
        place = f"{error.filename}: " if error.filename else ""
        print(f"stereocell: {place}{error.strerror or error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("stereocell: stopped; the same command goes on from here", file=sys.stderr)
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="stereocell",
        description="Turn a multi-channel volume into a USD stage, a web bundle and a stereo view.",
        epilog="example: stereocell build my.ome.zarr -o out/mine && stereocell view out/mine",
    )
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, (about, example, declare, handler) in COMMANDS.items():
        command = commands.add_parser(
            name,
            help=about,
            description=f"{about[0].upper()}{about[1:]}.",
            epilog=f"example: stereocell {example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        declare(command)
        command.set_defaults(handler=handler)
    return parser


# --- arguments


def _input(parser: argparse.ArgumentParser) -> None:
    _source(parser)
    parser.add_argument("-o", "--out", type=Path, required=True, help="folder of the results")


def _source(parser: argparse.ArgumentParser) -> None:
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


def _workers(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--workers",
        type=_count,
        default=_cores(),
        help="worker processes; 0 runs inline (default: the cores that it may run on)",
    )


def _cores() -> int:
    if hasattr(os, "sched_getaffinity"):  # not on macOS and Windows
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _out(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("out", type=Path, help="folder of a build")


def _count(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number of at least 0")
    return int(text)


def _numbers(text: str, kind: type[int] | type[float], flag: str) -> list[Any]:
    from stereocell.errors import UsageError

    try:
        values = [kind(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3:
        raise UsageError(f"{flag} is {text!r}, expected three numbers z,y,x")
    return values


def _once(flag: str, name: str, given: Container[str]) -> None:
    from stereocell.errors import UsageError

    if name in given:
        raise UsageError(f"{flag} names channel {name!r} twice, expected once")


def _flags(options: argparse.Namespace) -> dict[str, Any]:
    """Return the flags as the TOML's sections and keys."""
    from stereocell.errors import UsageError

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
        plan["tile_size"] = _numbers(options.tile_size, int, "--tile-size")
    if options.spacing_um is not None:
        plan["spacing_um"] = _numbers(options.spacing_um, float, "--spacing-um")
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


# --- handlers; heavy imports wait until they are needed, so that --help is quick


def _settings(options: argparse.Namespace) -> int:
    from stereocell import config

    settings = config.load(options.preset, options.config, {})
    sys.stdout.write(config.to_toml(settings, config.TEMPLATE))
    return 0


def _lists_series(options: argparse.Namespace) -> bool:
    """Print the series of a source if that is all that was asked for."""
    if options.series != "list":
        return False
    from stereocell import read

    print("\n".join(read.list_series(options.input)))
    return True


def _plan(options: argparse.Namespace) -> int:
    if _lists_series(options):
        return 0
    from stereocell import build, config

    settings = config.load(options.preset, options.config, _flags(options))
    build.make(options.input, options.out, settings)
    return 0


def _iso(options: argparse.Namespace) -> int:
    if _lists_series(options):
        return 0
    from stereocell import config, iso_preview

    settings = config.load(options.preset, options.config, _flags(options))
    candidates, path = iso_preview.preview(
        options.input, options.channel, options.tile, options.out, settings
    )
    print("\n".join(iso_preview.table(candidates)))
    print(f"wrote {path}")
    return 0


def _phases(options: argparse.Namespace, *names: str) -> int:
    from stereocell import build
    from stereocell.engine import Engine

    engine = Engine(getattr(options, "workers", 0))
    try:
        for name in names:
            if name == "units":
                build.run_units(options.out, engine, getattr(options, "only", None))
            elif name == "stage":
                build.run_stage(options.out, engine)
            elif name == "bundle":
                build.run_bundle(options.out, engine, getattr(options, "stage", None))
            else:
                build.run_report(options.out)
    finally:
        engine.close()
    return 0


def _slices(options: argparse.Namespace) -> int:
    if _lists_series(options):
        return 0
    from stereocell import build, config
    from stereocell.read.location import require_apart
    from stereocell.slices import write_slices

    settings = config.load(options.preset, options.config, _flags(options))
    require_apart(options.input, options.out)
    count = write_slices(build.settle(options.input, settings), options.out)
    print(f"wrote {count} slices to {options.out}")
    return 0


def _build(options: argparse.Namespace) -> int:
    if _lists_series(options):
        return 0
    _plan(options)
    _phases(options, "units", "stage", "bundle", "report")
    print(f"stage    {options.out}/stage/stage.usda")
    print(f"bundle   {options.out}/bundle/index.html")
    print(f"report   {options.out}/report/index.html")
    print(f"look at it: stereocell view {options.out}")
    return 0


def _sample(options: argparse.Namespace) -> int:
    from stereocell import samples

    if options.name == "cycif":
        columns, _, rows = options.grid.partition("x")
        if not (columns.isdecimal() and rows.isdecimal() and int(columns) and int(rows)):
            from stereocell.errors import UsageError

            raise UsageError(f"--grid is {options.grid!r}, expected columns x rows, as 5x2")
        z, y, x = _numbers(options.tile_size, int, "--tile-size")
        samples.write_cycif(
            options.out,
            grid=(int(columns), int(rows)),
            tile_size=(z, y, x),
            seed=options.seed,
            brightness_spread=options.brightness_spread,
        )
    elif options.name == "mri":
        samples.write_head(options.out, options.seed)
    else:
        samples.write_brain_cells(options.out)
    print(f"wrote {options.out}")
    return 0


def _tissue(options: argparse.Namespace) -> int:
    from stereocell.tissue_channels import TissueRequest, add_tissue, parse_classes

    classes = None if options.classes is None else parse_classes(options.classes)
    request = TissueRequest(classes, options.channel, options.model, options.everywhere)
    add_tissue(options.out, request)
    return _phases(options, "units", "stage", "bundle", "report")


def _check(options: argparse.Namespace) -> int:
    from stereocell.check import check

    failed = 0
    for line in check(options.out):
        failed += not line.ok
        print(f"{'ok  ' if line.ok else 'FAIL'} {line.name}: {line.detail}")
    return 1 if failed else 0


def _view(options: argparse.Namespace) -> int:
    from stereocell.serve import serve

    serve(options.out, options.port, lan=False, open_browser=not options.no_browser)
    return 0


def _serve(options: argparse.Namespace) -> int:
    from stereocell.serve import serve

    serve(options.out, options.port, lan=options.lan, open_browser=False)
    return 0


def _declare_settings(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--preset", help="cycif, lightsheet, mri, or a TOML file of your own")
    parser.add_argument("--config", type=Path, help="a TOML file of settings")


def _declare_build(parser: argparse.ArgumentParser) -> None:
    _input(parser)
    _workers(parser)


def _declare_iso(parser: argparse.ArgumentParser) -> None:
    _source(parser)
    parser.add_argument("--channel", required=True, metavar="X", help="by name or index, as CD31")
    parser.add_argument("--tile", required=True, help="as a build names it: r0_c0")
    parser.add_argument(
        "-o", "--out", type=Path, metavar="PNG", help="default: iso_CHANNEL_TILE.png here"
    )


def _declare_units(parser: argparse.ArgumentParser) -> None:
    _out(parser)
    _workers(parser)
    parser.add_argument("--only", metavar="TILE/CHANNEL", help="build one unit, as r0_c3/CD31")


def _declare_stage(parser: argparse.ArgumentParser) -> None:
    _out(parser)
    _workers(parser)


def _declare_bundle(parser: argparse.ArgumentParser) -> None:
    _out(parser)
    _workers(parser)
    parser.add_argument("--stage", type=Path, help="an edited stage, instead of OUT/stage")


def _declare_tissue(parser: argparse.ArgumentParser) -> None:
    _out(parser)
    _workers(parser)
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


def _declare_sample(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("name", choices=["cycif", "brain-cells", "mri"])
    parser.add_argument("out", type=Path, metavar="OUT", help="file or folder to write")
    parser.add_argument(
        "--seed", type=int, default=0, help="cycif, mri: another seed, another block or noise"
    )
    cycif = parser.add_argument_group("cycif")
    cycif.add_argument(
        "--grid", default="5x2", help="columns x rows of tiles (default %(default)s)"
    )
    cycif.add_argument("--tile-size", default="64,128,128", help="z,y,x (default %(default)s)")
    cycif.add_argument(
        "--brightness-spread", type=float, default=1.0, help="cells are up to 1 + this as bright"
    )


def _declare_view(parser: argparse.ArgumentParser) -> None:
    _port(parser)
    parser.add_argument("--no-browser", action="store_true", help="don't open a browser")


def _declare_serve(parser: argparse.ArgumentParser) -> None:
    _port(parser)
    parser.add_argument(
        "--lan",
        action="store_true",
        help="also for phones in this network: TLS, and a QR code that lets one device in",
    )


def _port(parser: argparse.ArgumentParser) -> None:
    _out(parser)
    parser.add_argument("--port", type=_count, default=8000, help="default 8000; 0: any free one")


COMMANDS: dict[str, tuple[str, str, Callable[[argparse.ArgumentParser], None], Handler]] = {
    "build": (
        "do all of it: plan, units, stage, bundle, report",
        "build my.ome.zarr -o out/mine --preset cycif --grid 5x2",
        _declare_build,
        _build,
    ),
    "plan": (
        "settle what is built: level, region, tiles, channels",
        "plan my.ome.tif -o out/mine --channels CD31,MART1",
        _input,
        _plan,
    ),
    "iso": (
        "look at one tile's iso-value: slices with the contours of every candidate",
        "iso my.ome.zarr --channel CD31 --tile r0_c0 -o cd31.png --preset cycif --grid 5x2",
        _declare_iso,
        _iso,
    ),
    "slices": (
        "write 8-bit PNG slices of one channel, with a JSON of spacing and window",
        "slices scans/head -o out/slices --preset mri --series 2",
        _input,
        _slices,
    ),
    "units": (
        "find iso-values, build meshes and volumes of every tile and channel",
        "units out/mine --workers 4 --only r0_c3/CD31",
        _declare_units,
        lambda options: _phases(options, "units"),
    ),
    "stage": (
        "write the USD stage from the units",
        "stage out/mine",
        _declare_stage,
        lambda options: _phases(options, "stage"),
    ),
    "bundle": (
        "export the web bundle from the composed USD stage",
        "bundle out/mine --stage edited.usda",
        _declare_bundle,
        lambda options: _phases(options, "bundle"),
    ),
    "report": (
        "write a page with pictures, sizes and times",
        "report out/mine",
        _out,
        lambda options: _phases(options, "report"),
    ),
    "tissue": (
        "find tissue classes, and build each as a channel of probabilities",
        "tissue out/head --classes 3",
        _declare_tissue,
        _tissue,
    ),
    "check": (
        "hold everything that was written against its format's rules",
        "check out/mine",
        _out,
        _check,
    ),
    "view": (
        "serve the bundle on localhost and open a browser",
        "view out/mine",
        _declare_view,
        _view,
    ),
    "serve": (
        "serve the bundle and stream its volumes by view, here or (--lan) to phones",
        "serve out/mine --lan",
        _declare_serve,
        _serve,
    ),
    "sample": (
        "write a sample volume, with no network",
        "sample cycif demo.ome.zarr --grid 5x2 --seed 1",
        _declare_sample,
        _sample,
    ),
    "settings": (
        "print every setting as TOML, with its default and a comment",
        "settings --preset cycif > stereocell.toml",
        _declare_settings,
        _settings,
    ),
}

if __name__ == "__main__":
    sys.exit(main())
