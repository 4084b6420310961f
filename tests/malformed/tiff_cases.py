# ruff: noqa: E501  (tables of cases)
"""OME-TIFF: cut and flipped files, tags that lie, directories in a ring, odd OME-XML."""

import os
import re
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from malformed.cases import ODD_NAMES, Case, copied, plan

KIND = "tiff"
_NS = "http://www.openmicroscopy.org/Schemas/OME/2016-06"
_PLANES, _SIZE = 4, 16
_HUGE = 4 << 30
_TYPES = {"H": 3, "I": 4, "s": 2}  # codes of TIFF by struct's letters; s: text
Tags = dict[int, tuple[str, Any]]


def cases() -> Iterator[Case]:
    for name in ("f.ome.tif", "t.ome.tif"):
        yield _damaged(f"{name} is empty", name, lambda p: p.write_bytes(b""))
    yield _damaged("head of zeros", "f.ome.tif", lambda p: p.write_bytes(bytes(5000)))
    yield from _tags()
    yield from _directories()
    yield from _texts()
    yield from _others()
    yield from _names()


def _damaged(name: str, file: str, spoil: Callable[[Path], Any]) -> Case:
    def make(base: Path, folder: Path) -> list[str]:
        path = copied(base, folder, file)
        spoil(path)
        return plan(path.name)

    return Case(name, KIND, make)


def xml(
    pixels: str = "",
    inside: str = "",
    channel: str = 'Name="F"',
    head: str = "",
    depth: Any = _PLANES,
) -> str:
    """Return OME-XML of 4 planes of 16 x 16; `pixels` is inserted before the usual attributes."""
    given = {part.split("=")[0] for part in pixels.split()}
    usual = {
        "DimensionOrder": "XYZCT", "Type": "uint16", "SizeX": _SIZE, "SizeY": _SIZE, "SizeZ": depth,
        "SizeC": 1, "SizeT": 1, "PhysicalSizeX": 0.2, "PhysicalSizeY": 0.2, "PhysicalSizeZ": 0.5,
    }  # fmt: skip
    rest = " ".join(f'{key}="{value}"' for key, value in usual.items() if key not in given)
    inside = inside or f'<TiffData IFD="0" PlaneCount="{_PLANES}"/>'
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>{head}<OME xmlns="{_NS}"><Image ID="Image:0">'
        f'<Pixels ID="Pixels:0" {pixels} {rest}><Channel ID="Channel:0:0" {channel}/>{inside}'
        "</Pixels></Image></OME>"
    )


def behind_comment(text: str) -> str:
    """Return OME-XML without its name in the first characters."""
    return f"<!--{'x' * 5000}-->" + text.partition("?>")[2]


def with_prefix(text: str) -> str:
    """Return OME-XML with a prefix for its namespace, and another namespace."""
    text = re.sub(r"<(/?)(?=[A-Z])", r"<\1o:", text.partition("?>")[2])
    return text.replace(f'xmlns="{_NS}"', 'xmlns:o="x"')


def write_tiff(
    path: Path,
    text: str | bytes | None = None,
    tags: Tags | None = None,
    strip: bytes | None = None,
    following: int | None = None,
) -> None:
    """Write a classic TIFF by hand, with one strip per plane.

    tags       replace the usual ones, in every directory
    strip      bytes of every plane
    following  position of the next directory that the last one states; None: there is none
    """
    plane = np.arange(_SIZE * _SIZE, dtype="<u2").tobytes() if strip is None else strip
    content = bytearray(b"II*\0\0\0\0\0")
    text = xml() if text is None else text
    described = (text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass")) + b"\0"
    link = 4  # where the position of the next directory is written
    for index in range(_PLANES):
        start = len(content)
        content += plane
        content += b"\0" * (len(content) % 2)
        found: Tags = {
            256: ("I", _SIZE), 257: ("I", _SIZE), 258: ("H", 16), 259: ("H", 1), 262: ("H", 1),
            273: ("I", start), 277: ("H", 1), 278: ("I", _SIZE), 279: ("I", len(plane)),
        }  # fmt: skip
        if index == 0:
            found[270] = ("s", described)
        found |= tags or {}
        outside = []
        entries = b""
        at = len(content)
        free = at + 2 + 12 * len(found) + 4
        for tag, (kind, value) in sorted(found.items()):
            code = _TYPES[kind]
            values = list(value) if isinstance(value, list | bytes) else [value]
            packed = bytes(values) if kind == "s" else struct.pack(f"<{len(values)}{kind}", *values)
            if len(packed) > 4:
                outside.append(packed + b"\0" * (len(packed) % 2))
                where = struct.pack("<I", free)
                free += len(outside[-1])
            else:
                where = packed.ljust(4, b"\0")
            entries += struct.pack("<HHI", tag, code, len(values)) + where
        struct.pack_into("<I", content, link, at)
        link = at + 2 + len(entries)
        content += struct.pack("<H", len(found)) + entries + bytes(4) + b"".join(outside)
    if following is not None:
        struct.pack_into("<I", content, link, following)
    path.write_bytes(content)


def _made(name: str, expect: str = "any", **content: Any) -> Case:
    def make(base: Path, folder: Path) -> list[str]:
        write_tiff(folder / "x.ome.tif", **content)
        return plan("x.ome.tif")

    return Case(name, KIND, make, expect)


def _tags() -> Iterator[Case]:
    yield _made("by hand, sound", "done")
    far, most = 0xFFFFFFF0, 0xFFFFFFFF
    for name, tag, value in (
        ("width of 0", 256, ("I", 0)), ("width of 2^32", 256, ("I", most)),
        ("length of 0", 257, ("I", 0)), ("length of 2^32", 257, ("I", most)),
        ("0 bits", 258, ("H", 0)), ("7 bits", 258, ("H", 7)), ("65535 bits", 258, ("H", 65535)),
        ("bits of two kinds", 258, ("H", [8, 16])), ("unknown compression", 259, ("H", 9999)),
        ("JPEG that is none", 259, ("H", 7)), ("LZW that is none", 259, ("H", 5)),
        ("JPEG XL that is none", 259, ("H", 50002)), ("CCITT", 259, ("H", 4)),
        ("strips beyond the file", 273, ("I", far)), ("strips at 0", 273, ("I", 0)),
        ("1000 strips", 273, ("I", [8] * 1000)), ("0 samples", 277, ("H", 0)),
        ("65535 samples", 277, ("H", 65535)), ("0 rows a strip", 278, ("I", 0)),
        ("2^32 rows a strip", 278, ("I", most)), ("strips of 2^32 bytes", 279, ("I", far)),
        ("strips of 0 bytes", 279, ("I", 0)), ("palette", 262, ("H", 3)),
        ("unknown photometric", 262, ("H", 999)), ("separate planes", 284, ("H", 2)),
        ("unknown predictor", 317, ("H", 77)), ("float predictor", 317, ("H", 3)),
        ("sample format of 9", 339, ("H", 9)), ("complex samples", 339, ("H", 6)),
        ("float samples", 339, ("H", 3)), ("tiles of 0", 322, ("I", 0)),
        ("tiles of 2^31", 322, ("I", 1 << 31)), ("depth of 2^32", 32997, ("I", most)),
        ("fill order", 266, ("H", 2)), ("orientation of 99", 274, ("H", 99)),
    ):  # fmt: skip
        yield _made(name, tags={tag: value})
    both: Tags = {256: ("I", most), 257: ("I", most), 278: ("I", most)}
    yield _made(
        "2^32 each way", "refused", tags=both, text=xml('SizeX="4294967295" SizeY="4294967295"')
    )
    # A plane of this size is still allowed: its memory must not be allocated before the check.
    large: Tags = {256: ("I", 40000), 257: ("I", 40000), 278: ("I", 40000), 259: ("H", 8)}
    yield _made(
        "planes of 3.2 GB in 600 bytes", "refused", tags=large,
        text=xml('SizeX="40000" SizeY="40000"'), strip=zlib.compress(bytes(300_000)),
    )  # fmt: skip
    tiles: Tags = {322: ("I", 16), 323: ("I", 16), 324: ("I", [8] * 3), 325: ("I", [0, 1, 2])}
    yield _made("tiles and strips", tags=tiles)
    block = zlib.compressobj(9)
    first = block.compress(bytes(1 << 20)) + block.flush(zlib.Z_FULL_FLUSH)
    again = block.compress(bytes(1 << 20)) + block.flush(zlib.Z_FULL_FLUSH)
    yield _made("zlib bomb", strip=first + again * (_HUGE >> 20), tags={259: ("H", 8)})
    yield _made("zlib bomb cut short", strip=first + again * 100, tags={259: ("H", 32946)})
    runs = b"".join(struct.pack("<I", (1 << 17) << 3 | 2)[:3] + b"\0" for _ in range(_HUGE >> 17))
    zstd = b"\x28\xb5\x2f\xfd"
    yield _made("zstd bomb", strip=zstd + b"\0\x38" + runs + b"\x01\0\0", tags={259: ("H", 50000)})
    frame = zstd + b"\xe0" + struct.pack("<Q", 1 << 60) + b"\x01\0\0"
    yield _made("zstd claims 2^60", strip=frame, tags={259: ("H", 50000)})


def _directories() -> Iterator[Case]:
    first = 8 + 2 * _SIZE * _SIZE  # position of the first directory
    yield _made("directories in a ring", following=first)
    yield _made("next directory beyond the file", following=0xFFFFFF00)
    yield _made("next directory in the pixels", following=10)
    yield _made("sub-directory is its own parent", tags={330: ("I", first)})
    yield _made("sub-directory beyond the file", tags={330: ("I", 0xFFFFFF00)})
    yield _made("10000 sub-directories", tags={330: ("I", [first] * 10000)})

    def bad_big(base: Path, folder: Path) -> list[str]:
        head = struct.pack("<2sHHHQ", b"II", 43, 8, 0, 16) + struct.pack("<Q", 1 << 60)
        (folder / "x.ome.tif").write_bytes(head + bytes(400))
        return plan("x.ome.tif")

    yield Case("BigTIFF of 2^60 tags", KIND, bad_big, "refused")

    def absurd(base: Path, folder: Path) -> list[str]:
        write_tiff(folder / "x.ome.tif")
        content = bytearray((folder / "x.ome.tif").read_bytes())
        struct.pack_into("<I", content, first + 2 + 4, 0xFFFFFFFF)  # count of the first tag
        (folder / "x.ome.tif").write_bytes(content)
        return plan("x.ome.tif")

    yield Case("tag of 2^32 values", KIND, absurd)


def _texts() -> Iterator[Case]:
    bombs = '<!DOCTYPE b [<!ENTITY a0 "' + "ha" * 50 + '">' + "".join(
        f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 12)
    ) + "]>"  # fmt: skip
    outside = '<!DOCTYPE b [<!ENTITY x SYSTEM "bait/secret.txt">]>'
    for name, text, expect in (
        ("XML is none", "<OME", "refused"), ("XML empty", "", "refused"),
        ("XML of another kind", "<html><body/></html>", "refused"),
        ("XML without images", f'<OME xmlns="{_NS}"/>', "refused"),
        ("XML cut short", xml()[:300], "refused"),
        ("XML no UTF-8", xml().encode() + b"\xff\xfe", "refused"),
        ("entity bomb", xml(channel='Name="&a11;"', head=bombs), "refused"),
        ("entity from a file", xml(channel='Name="&x;"', head=outside), "refused"),
        ("entity from a network", xml(channel='Name="&x;"', head=outside.replace("bait", "http://127.0.0.1:9")), "refused"),
        ("XML nested", f'<OME xmlns="{_NS}">' + "<a>" * 100_000 + "</a>" * 100_000 + "</OME>", "refused"),
        ("entity bomb before a comment", xml(channel='Name="&a11;"', head=bombs) + "<!-- an end that is none of OME's -->", "refused"),
        ("XML of 10^6 channels", xml('SizeC="1000000"'), "refused"),
        ("XML of 10^9 planes", xml(depth=10**9), "refused"),
        ("XML of 10^9 times", xml('SizeT="1000000000"'), "refused"),
        ("XML of 10^6 each way", xml('SizeX="1000000" SizeY="1000000"', depth=10**6), "refused"),
        ("XML of size 0", xml(depth=0), "refused"), ("XML of size -1", xml(depth=-1), "refused"),
        ("XML of size 10^400", xml(depth=10**400), "refused"),
        ("XML of size 1.5", xml(depth=1.5), "refused"),
        ("XML of a wrong type", xml('Type="double"'), "any"),
        ("XML of no type", xml('Type="uint77"'), "any"),
        ("XML of an odd order", xml('DimensionOrder="XXXXX"'), "refused"),
        ("spacing inf", xml('PhysicalSizeZ="INF"'), "refused"),
        ("spacing NaN", xml('PhysicalSizeX="NaN"'), "refused"),
        ("spacing 1e400", xml('PhysicalSizeX="1e400"'), "refused"),
        ("spacing empty", xml('PhysicalSizeX=""'), "refused"),
        ("spacing in words", xml('PhysicalSizeX="big"'), "refused"),
        ("spacing 1e300", xml('PhysicalSizeX="1e300"'), "any"),
        ("unit unknown", xml('PhysicalSizeXUnit="parsec\u2603"'), "refused"),
        ("TiffData beyond", xml(inside='<TiffData IFD="4000000000"/>'), "refused"),
        ("TiffData of 10^9 planes", xml(inside='<TiffData IFD="0" PlaneCount="1000000000"/>'), "any"),
        ("TiffData of -1", xml(inside='<TiffData IFD="-1" PlaneCount="-5"/>'), "any"),
        ("TiffData nowhere", xml(inside="<MetadataOnly/>"), "any"),
        ("10000 images", xml().replace("</Image>", "</Image>" + '<Image ID="Image:1"/>' * 10000), "any"),
    ):  # fmt: skip
        yield _made(name, expect, text=text)


def _others() -> Iterator[Case]:
    """Planes in another file, which is intact, so that a reader that opens it succeeds."""
    links = {
        "link out": "../bait/x.ome.tif",
        "link within": "own/x.ome.tif",
        "link to a device": "/dev/zero",
    }
    for name, target, expect in (
        ("own", "own/x.ome.tif", "done"), ("within by a detour", "own/../own/x.ome.tif", "done"),
        ("parent", "../bait/x.ome.tif", "refused"), ("absolute", "{}/bait/x.ome.tif", "refused"),
        ("link out", "x2.ome.tif", "refused"), ("link within", "x2.ome.tif", "done"),
        ("link to a device", "x2.ome.tif", "refused"), ("folder that is a link out", "away/x.ome.tif", "refused"),
        ("pipe", "x2.ome.tif", "refused"), ("endless", "/dev/zero", "refused"), ("folder", "own", "refused"),
        ("backslash", "..\\bait\\x.ome.tif", "refused"), ("address", "http://127.0.0.1:9/x.tif", "refused"),
        ("itself", "x.ome.tif", "any"), ("nowhere", "own/y.ome.tif", "refused"), ("empty", "", "refused"),
        ("behind a long comment", "../bait/x.ome.tif", "refused"), ("with a prefix", "../bait/x.ome.tif", "refused"),
    ):  # fmt: skip

        def make(base: Path, folder: Path, name: str = name, target: str = target) -> list[str]:
            home = folder / "home"
            (home / "own").mkdir(parents=True)
            target = target.format(folder)
            uuid = f'<TiffData IFD="0" PlaneCount="4"><UUID FileName="{target}">urn:uuid:00000000-0000-0000-0000-000000000001</UUID></TiffData>'
            text = xml(inside=uuid).replace(
                "<OME ", '<OME UUID="urn:uuid:00000000-0000-0000-0000-000000000002" '
            )
            if name == "behind a long comment":
                text = behind_comment(text)
            elif name == "with a prefix":
                text = with_prefix(text)
            write_tiff(home / "x.ome.tif", text)
            write_tiff(home / "own" / "x.ome.tif")
            write_tiff(folder / "bait" / "x.ome.tif")
            os.symlink("../bait", home / "away")
            if name in links:
                os.symlink(links[name], home / "x2.ome.tif")
            elif name == "pipe":
                os.mkfifo(home / "x2.ome.tif")
            there = (home / target).exists()
            if there == (name in ("backslash", "address", "nowhere")):
                raise RuntimeError(f"{name}: the bait is not where the case says")
            return plan("home/x.ome.tif")

        yield Case(f"planes in another file: {name}", KIND, make, expect)
    for name in ("pipe", "endless"):

        def made(base: Path, folder: Path, name: str = name) -> list[str]:
            path = folder / "x.ome.tif"
            os.mkfifo(path) if name == "pipe" else os.symlink("/dev/zero", path)
            return plan("x.ome.tif")

        yield Case(f"is {name}", KIND, made, "refused")


def _names() -> Iterator[Case]:
    quoted = {ord(c): f"&#{ord(c)};" for c in '<>&"\n'}
    for name, text in ODD_NAMES.items():
        shown = text.translate(quoted)
        odd = name in ("nul", "bell", "surrogate")  # XML can't hold these
        yield _made(
            f"channel named {name}", "any" if odd else "done", text=xml(channel=f'Name="{shown}"')
        )
