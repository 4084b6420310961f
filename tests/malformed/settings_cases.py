# ruff: noqa: E501  (tables of cases)
"""Settings: invalid TOML, absurd values, odd flags, odd names of files and of OUT."""

import os
from collections.abc import Iterator
from pathlib import Path

from malformed.cases import ODD_NAMES, Case, copied, plan, slices

KIND = "settings"
_TOML: dict[str, bytes] = {
    "empty": b"", "no TOML": b"[plan\nx", "no UTF-8": b"\xff\xfe[plan]", "nul": b"[plan]\0", "a list": b"plan = []",
    "nested": b"x = " + b"[" * 50_000 + b"]" * 50_000, "nested tables": b"a" + b".a" * 50_000 + b" = 1",
    "long number": b"[plan]\nmax_voxels = " + b"9" * 5000, "level in words": b'[plan]\nlevel = "fine"',
    "level true": b"[plan]\nlevel = true", "level below 0": b"[plan]\nlevel = -1", "level of 10^30": b"[plan]\nlevel = 1" + b"0" * 30,
    "unknown key": b"[plan]\nlevle = 1", "unknown section": b"[plam]\nlevel = 1", "key twice": b"[plan]\ntime = 1\ntime = 2",
    "section is a number": b"plan = 3", "channels of numbers": b"[plan]\nchannels = [1, 2]", "channels of lists": b"[plan]\nchannels = [[]]",
    "channel empty": b'[plan]\nchannels = [""]', "region in a list": b"[plan]\nregion = [0, 1]", "region of words": b'[plan]\nregion = "all"',
    "tile_size 0": b"[plan]\ntile_size = [0, 0, 0]", "tile_size below 0": b"[plan]\ntile_size = [-1, 5, 5]", "tile_size 10^30": b"[plan]\ntile_size = [1" + b"0" * 30 + b", 9, 9]",
    "tile_size of 4": b"[plan]\ntile_size = [4, 4, 4, 4]", "tile_size of 0 numbers": b"[plan]\ntile_size = []", "max_voxels 0": b"[plan]\nmax_voxels = 0",
    "spacing NaN": b"[plan]\nspacing_um = [nan, 1.0, 1.0]", "spacing inf": b"[plan]\nspacing_um = [inf, 1.0, 1.0]", "spacing 1e300": b"[plan]\nspacing_um = [1e300, 1.0, 1.0]",
    "spacing 1e-300": b"[plan]\nspacing_um = [1e-300, 1.0, 1.0]", "spacing of 2": b"[plan]\nspacing_um = [1.0, 1.0]", "modality odd": b'[plan]\nmodality = "\\u202e"',
    "percentile NaN": b"[window]\nlow_percentile = nan", "percentile 101": b"[window]\nhigh_percentile = 101.0", "percentiles turned": b"[window]\nlow_percentile = 90.0\nhigh_percentile = 10.0",
    "smoothing inf": b"[surface]\nsmoothing_um = inf", "smoothing below 0": b"[surface]\nsmoothing_um = -1.0", "smoothing 1e300": b"[surface]\nsmoothing_um = 1e300",
    "alpha in words": b'[surface]\nalpha_um = "wide"', "alpha 1e9": b"[surface]\nalpha_um = 1e9", "grid_um 1e9": b"[surface]\ngrid_um = 1e9", "grid_um below 0": b"[surface]\ngrid_um = -1.0",
    "max_faces 0": b"[surface]\nmax_faces = 0", "max_faces in words": b'[surface]\nmax_faces = "few"', "max_faces NaN": b"[surface]\nmax_faces = nan", "max_faces 1": b"[surface]\nmax_faces = 1",
    "offset 100": b"[surface]\noffset_um = 100.0", "background 1e-9": b"[surface]\nbackground_um = 1e-9", "wrap odd": b'[surface]\nwrap = "../x"', "closed_tiles 1": b"[surface]\nclosed_tiles = 1",
    "criterion odd": b'[isovalue]\ncriterion = "\\n"', "iso value of nobody": b"[iso_values]\nZZZ = 3.0", "iso value NaN": b"[iso_values]\nF = nan", "iso value in words": b'[iso_values]\nF = "x"',
    "iso value of the empty name": b'[iso_values]\n"" = 1.0', "paint itself": b'[paint]\nF = "F"', "paint nobody": b'[paint]\nF = "Z"', "paint a number": b"[paint]\nF = 7",
    "bits 12": b"[volume]\nbits = 12", "bits in words": b'[volume]\nbits = "all"', "LOD errors": b"[lod]\nlevels = -3", "date": b"[plan]\nlevel = 2020-01-01", "dots in keys": b'["plan.level"]\nx = 1', "control characters in a key": b'["pl\\u0007an"]\nx = 1',
    "array of tables": b"[[plan]]\nlevel = 1", "section of dates": b"plan = 1979-05-27T07:32:00Z",
}  # fmt: skip
_FLAGS: dict[str, list[str]] = {
    "level NaN": ["--level", "nan"], "level 10^30": ["--level", "1" + "0" * 30], "level -1": ["--level=-1"],
    "channels empty": ["--channels", ""], "channels of commas": ["--channels", ",,"], "channel unknown": ["--channels", "\u202eZ\n"],
    "channel 10^400": ["--channels", "1" + "0" * 400], "region empty": ["--region", ""], "region turned": ["--region", "9:3,0:9,0:9"],
    "region beyond": ["--region", "0:99999999999999999999,0:9,0:9"], "region of words": ["--region", "a:b,c:d,e:f"],
    "region of digits that are none": ["--region", "0:\u00b2,0:9,0:9"], "channel of digits that are none": ["--channels", "\u00b2"],
    "tile-size of words": ["--tile-size", "a,b,c"], "tile-size 1": ["--tile-size", "1,1,1"], "tile-size 10^20": ["--tile-size", "1" + "0" * 20 + ",9,9"],
    "grid 0": ["--grid", "0x0"], "grid 10^9": ["--grid", "1000000000x1000000000"], "grid of words": ["--grid", "axb"], "grid twice": ["--grid", "2x2x2"],
    "grid of digits that are none": ["--grid", "\u0662x\u0661"], "grid and tile-size": ["--grid", "2x1", "--tile-size", "9,9,9"], "time 5": ["--time", "5"],
    "time -1": ["--time=-1"], "time 10^30": ["--time", "1" + "0" * 30], "series 1": ["--series", "1"], "series 0": ["--series", "0"], "series \u00b2": ["--series", "\u00b2"],
    "series list": ["--series", "list"], "spacing NaN": ["--spacing-um", "nan,1,1"], "spacing inf": ["--spacing-um", "inf,1,1"], "spacing 0": ["--spacing-um", "0,1,1"],
    "spacing 1e300": ["--spacing-um", "1e300,1e300,1e300"], "spacing 1e-300": ["--spacing-um", "1e-300,1,1"], "spacing of 2": ["--spacing-um", "1,1"],
    "iso-value without a name": ["--iso-value", "=3"], "iso-value NaN": ["--iso-value", "F=nan"], "iso-value inf": ["--iso-value", "F=inf"], "iso-value twice": ["--iso-value", "F=1", "--iso-value", "F=2"],
    "iso-value of an index and a name": ["--iso-value", "F=1", "--iso-value", "0=2"], "paint itself": ["--paint", "F=F"], "paint nobody": ["--paint", "F=\n"],
    "criterion unknown": ["--iso-criterion", "best"], "wrap unknown": ["--wrap", "foil"], "preset unknown": ["--preset", "../../bait/secret"], "preset of a folder": ["--preset", "bait.toml"],
    "config nowhere": ["--config", "nowhere.toml"], "config a folder": ["--config", "bait"], "config empty": ["--config", ""], "unknown flag": ["--colour", "red"],
    "preset long": ["--preset", "x" * 5000 + ".toml"],
}  # fmt: skip


def cases() -> Iterator[Case]:
    for name, content in _TOML.items():
        for flag in ("--config", "--preset"):

            def show(
                base: Path, folder: Path, content: bytes = content, flag: str = flag
            ) -> list[str]:
                (folder / "x.toml").write_bytes(content)
                return ["settings", flag, "x.toml"]

            yield Case(f"settings {flag}: {name}", KIND, show)

        def make(base: Path, folder: Path, content: bytes = content) -> list[str]:
            (folder / "x.toml").write_bytes(content)
            return plan(copied(base, folder, "v4.zarr").name, "--config", "x.toml")

        yield Case(f"plan: {name}", KIND, make)
    for name, flags in _FLAGS.items():

        def given(base: Path, folder: Path, flags: list[str] = flags) -> list[str]:
            return plan(copied(base, folder, "v4.zarr").name, *flags)

        yield Case(f"flag: {name}", KIND, given)
    yield from _names()


def _names() -> Iterator[Case]:
    for name, text in ODD_NAMES.items():
        if "\0" in text:
            continue  # no shell can pass it
        for suffix in (".zarr", ".ome.tif"):

            def named(
                base: Path, folder: Path, text: str = text, suffix: str = suffix
            ) -> list[str]:
                target = os.path.join(
                    os.fsencode(folder / "in"),
                    text.encode("utf-8", "surrogatepass") + suffix.encode(),
                )
                os.makedirs(
                    os.path.dirname(os.path.abspath(os.path.dirname(target) + b"/x")), exist_ok=True
                )
                source = copied(base, folder, "v4.zarr" if suffix == ".zarr" else "f.ome.tif")
                try:
                    os.rename(source, target)
                except (OSError, ValueError):
                    # this file doesn't exist, which one line has to report
                    return plan("in/" + text + suffix)
                return plan(os.fsdecode(target))

            yield Case(f"{suffix} named {name}", "names", named)

        def out(base: Path, folder: Path, text: str = text) -> list[str]:
            (folder / "out").mkdir()
            return [
                "plan",
                copied(base, folder, "v4.zarr").name,
                "-o",
                f"out/x{text.replace('..', '.')}",
            ]

        if name not in ("surrogate",):
            yield Case(f"OUT named {name}", "names", out)
    for name, target in {
        "the input": "v4.zarr",
        "inside the input": "v4.zarr/0/x",
        "a file": "bait/secret.txt",
        "below a file": "bait/secret.txt/x",
        "without rights": "/proc/x",
        "a device": "/dev/null",
        "": "",
    }.items():

        def into(base: Path, folder: Path, target: str = target) -> list[str]:
            return ["plan", copied(base, folder, "v4.zarr").name, "-o", target]

        if name:
            yield Case(f"OUT is {name}", "names", into, "refused")

    def slices_over(base: Path, folder: Path) -> list[str]:
        copied(base, folder, "v4.zarr")
        return ["slices", "v4.zarr", "-o", "bait", "--channels", "F"]

    yield Case("slices into another's folder", "names", slices_over, "refused")
    yield Case(
        "slices of two channels",
        "names",
        lambda b, f: slices(copied(b, f, "v4.zarr").name),
        "refused",
    )
    for name, text in {
        "nothing": "",
        "a folder of nothing": "bait",
        "a scheme unknown": "gopher://x/y.zarr",
        "an address without host": "http:///x.zarr",
        "s3 without bucket": "s3://",
        "a broken address": "http://[::1/x.zarr",
        "a port of words": "http://localhost:x/y.zarr",
        "a dash": "-",
    }.items():
        yield Case(f"input is {name}", "names", lambda b, f, t=text: plan(t), "refused")
