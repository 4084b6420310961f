# ruff: noqa: E501  (tables of cases)
"""Plain TIFF and folders of planes: descriptions that lie, odd names, files that are not images."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
import tifffile

from malformed.cases import ODD_NAMES, Case, cut, flip, plan
from malformed.tiff_cases import write_tiff
from support.tiff_files import write_lsm, write_ndtiff, write_stk

KIND = "planes"
_SPACING = ("--spacing-um", "2,1,1")
_VOXELS = np.random.default_rng(0).integers(0, 999, (6, 16, 18)).astype(np.uint16)


def cases() -> Iterator[Case]:
    yield from _described()
    yield from _damaged()
    yield from _folders()


def _described() -> Iterator[Case]:
    """Descriptions of ImageJ and tifffile that state what the file does not hold."""
    head = "ImageJ=1.54f\n"
    for name, text, expect in (
        ("ImageJ, 10^9 slices", f"{head}images=1000000000\nslices=1000000000\n", "refused"),
        ("ImageJ, 10^400 slices", f"{head}images=4\nslices={10**400}\n", "refused"),
        ("ImageJ, -4 slices", f"{head}images=-4\nslices=-4\n", "any"),
        ("ImageJ, slices in words", f"{head}images=many\nslices=many\n", "any"),
        ("ImageJ, 10^5 each way", f"{head}images=4\nchannels=100000\nslices=100000\nframes=100000\n", "refused"),
        ("ImageJ, spacing NaN", f"{head}images=4\nslices=4\nspacing=nan\nunit=um\n", "any"),
        ("ImageJ, spacing 1e999", f"{head}images=4\nslices=4\nspacing=1e999\nunit=um\n", "any"),
        ("ImageJ, unit of controls", f"{head}images=4\nslices=4\nspacing=1\nunit=\x1b[31m\n", "any"),
        ("ImageJ, unit escaped wrongly", f"{head}images=4\nslices=4\nunit=\\uD800m\n", "any"),
        ("ImageJ, odd order", f"{head}images=4\nslices=4\norder=xyz\n", "any"),
        ("ImageJ alone", "ImageJ=\n", "any"),
        ("shaped, 10^9", '{"shape": [1000000000, 1000000000]}', "any"),
        ("shaped, 10^12 planes", '{"shape": [1000000000000, 16, 16]}', "any"),
        ("shaped, no numbers", '{"shape": ["a", null]}', "any"),
        ("shaped, empty", '{"shape": []}', "any"),
        ("shaped, odd axes", '{"shape": [4, 16, 16], "axes": "\\u2603"}', "any"),
        ("shaped, no JSON", '{"shape": [4, 16, 16', "any"),
        ("shaped, axes twice", '{"shape": [4, 16, 16], "axes": "ZZZ"}', "any"),
        ("MetaSeries of entities", '<MetaData><!DOCTYPE a [<!ENTITY b "c">]>&b;</MetaData>', "any"),
        ("MetaSeries of nothing", "<MetaData></MetaData>", "any"),
        ("SCIFIO", "SCIFIO=1\naxes=X,Y,Z\nlengths=1,1,1\n", "any"),
        ("text of 10 MB", "x" * 10_000_000, "any"),
    ):  # fmt: skip

        def make(base: Path, folder: Path, text: str = text) -> list[str]:
            write_tiff(folder / "x.tif", text)
            return plan("x.tif", *_SPACING)

        yield Case(f"described as {name}", KIND, make, expect)


def _damaged() -> Iterator[Case]:
    writers: dict[str, Callable[[Path], Any]] = {
        "lsm": lambda path: write_lsm(path, _VOXELS[:, None], (2, 1, 1), {"A": (255, 0, 0)}),
        "stk": lambda path: write_stk(path, _VOXELS, (2, 1, 1)),
        "ndtiff": lambda path: write_ndtiff(path, _VOXELS[None], ["A"]),
    }
    for kind, write in writers.items():
        for share in (0.0, 0.05, 0.5, 0.95):

            def shorten(path: Path, share: float = share) -> None:
                cut(path, share)

            yield _file(
                f"{kind} cut to {share:g}", write, shorten, "refused" if share < 0.5 else "any"
            )
        for seed in range(6):

            def garble(path: Path, seed: int = seed) -> None:
                flip(path, seed, 12, 0, 600)

            yield _file(f"{kind} with a flipped head {seed}", write, garble, "any")
    yield _file(
        "ndtiff with a flipped index", writers["ndtiff"],
        lambda path: flip(path.parent / "NDTiff.index", 3, 20), "any",
    )  # fmt: skip


def _file(
    name: str, write: Callable[[Path], Any], spoil: Callable[[Path], Any], expect: str
) -> Case:
    def make(base: Path, folder: Path) -> list[str]:
        write(folder / "x.tif")
        spoil(folder / "x.tif")
        return plan("x.tif", *_SPACING)

    return Case(name, KIND, make, expect)


def _in_folder(name: str, fill: Callable[[Path], Any], expect: str, *flags: str) -> Case:
    def make(base: Path, folder: Path) -> list[str]:
        home = folder / "home"
        home.mkdir()
        for z, plane in enumerate(_VOXELS):
            tifffile.imwrite(home / f"x_z{z}.tif", plane)
        fill(home)
        return plan("home", *_SPACING, *flags)

    return Case(f"folder: {name}", KIND, make, expect)


def _folders() -> Iterator[Case]:
    yield _in_folder("sound", lambda home: None, "done")
    for name, text in ODD_NAMES.items():
        if "\0" in text or "/" in text or name in ("surrogate", "long", "combining"):
            continue

        def rename(home: Path, text: str = text) -> None:
            for path in list(home.iterdir()):
                path.rename(home / f"{text}{path.name}")

        yield _in_folder(f"names with {name}", rename, "any")
    for name, target, expect in (
        ("link out", "../bait.tif", "refused"), ("link to a device", "/dev/zero", "refused"),
        ("link to nothing", "nothing.tif", "refused"), ("link within", "x_z0.tif", "done"),
        ("link in a ring", "x_z6.tif", "refused"),
    ):  # fmt: skip

        def link(home: Path, target: str = target) -> None:
            tifffile.imwrite(home.parent / "bait.tif", _VOXELS[0])
            os.symlink(target, home / "x_z6.tif")

        yield _in_folder(name, link, expect)
    yield _in_folder("pipe", lambda home: os.mkfifo(home / "x_z6.tif"), "refused")
    yield _in_folder("folder as a plane", lambda home: (home / "x_z6.tif").mkdir(), "done")
    yield _in_folder("gap", lambda home: (home / "x_z3.tif").unlink(), "refused")
    yield _in_folder(
        "a number of 400 digits", lambda home: tifffile.imwrite(home / f"x_z{'9' * 200}.tif", _VOXELS[0]), "refused",
    )  # fmt: skip
    yield _in_folder(
        "another size", lambda home: tifffile.imwrite(home / "x_z2.tif", _VOXELS[0, :9]), "refused"
    )
    yield _in_folder("empty plane", lambda home: (home / "x_z2.tif").write_bytes(b""), "refused")
    yield _in_folder("HTML", lambda home: (home / "x_z2.tif").write_text("<html>"), "refused")
    for pattern in (
        "{z}",
        "x_z{z}.tif",
        "{c}_z{z}.tif",
        "(" * 400,
        "{z}{z}",
        "*" * 90 + "{z}q",
        "{\u2603}",
    ):
        yield _in_folder(f"pattern {pattern[:20]}", lambda home: None, "any", "--pattern", pattern)
    for size in (0, 1 << 31):

        def png(home: Path, size: int = size) -> None:
            for z in range(3):
                content = bytearray(imagecodecs.png_encode(_VOXELS[0]))
                content[16:24] = size.to_bytes(4, "big") * 2
                (home / f"y_z{z}.png").write_bytes(content)
            for path in home.glob("*.tif"):
                path.unlink()

        yield _in_folder(f"PNG of {size} x {size}", png, "refused")
