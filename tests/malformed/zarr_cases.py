# ruff: noqa: E501  (tables of cases)
"""OME-Zarr: metadata that lie, paths that lead elsewhere, chunks that are absent or too large."""

import gzip
import json
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from malformed.cases import ODD_NAMES, Case, Change, copied, edit_json, nested, plan, put

KIND = "zarr"
_BAIT = "bait.zarr"
_HUGE = 4 << 30  # bytes that a bomb decompresses to
_BLOCK = 1 << 20
Spoil = Callable[[Path], None]


def _case(name: str, spoil: Spoil, expect: str = "any", version: int = 5) -> Case:
    def make(base: Path, folder: Path) -> list[str]:
        path = copied(base, folder, f"v{version}.zarr")
        spoil(path)
        return plan(path.name)

    return Case(name, KIND, make, expect)


def _json(name: str, file: str, change: Change, expect: str = "any", version: int = 5) -> Case:
    return _case(name, lambda path: edit_json(path / file, change), expect, version)


def cases() -> Iterator[Case]:
    yield from _damaged_text()
    yield from _arrays()
    yield from _images()
    yield from _collections()
    yield from _paths()
    yield from _links()
    yield from _chunks()


def _damaged_text() -> Iterator[Case]:
    files = {5: ("zarr.json", "0/zarr.json"), 4: (".zattrs", ".zgroup", "0/.zarray")}
    for version, names in files.items():
        for file in names:
            yield _case(
                f"{file} of 0.{version} empty",
                lambda path, file=file: _write(path / file, b""),
                "any" if "group" in file else "refused",
                version,
            )
        last = names[0]
        yield _case(
            f"{last} nested",
            lambda path, file=last: _write(path / file, nested()), "refused", version,
        )  # fmt: skip
        yield _case(
            f"{last} no text",
            lambda path, file=last: _write(path / file, b"\xff\xfe\0{"), "refused", version,
        )  # fmt: skip


def _write(path: Path, content: bytes) -> None:
    path.write_bytes(content)


_ARRAY: dict[str, tuple[Change, str]] = {
    **{
        f"data_type {kind}": (put("data_type", kind), "refused")
        for kind in ("int64", "uint64", "float64", "complex64", "bool", "string", "r24", "", None,
                     7, {"name": "numpy.datetime64"}, ["uint8"])
    },
    "data_type float16": (put("data_type", "float16"), "any"),  # the same size as the file's uint16
    "shape of 10^6 each way": (put("shape", [2, 10**6, 10**6, 10**6]), "any"),
    "shape and chunks of 10^6 each way": (
        lambda c: c.update(shape=[2, 10**6, 10**6, 10**6], chunk_grid=_grid([1, 10**6, 10**6, 10**6])),
        "refused",
    ),
    "shape beyond 64 bits": (put("shape", [2, 2**63, 48, 36]), "refused"),
    "shape of 10^400": (put("shape", [2, 10**400, 48, 36]), "refused"),
    "chunks whose product wraps": (
        lambda c: c.update(shape=[2, 2**40, 2**40, 2**40], chunk_grid=_grid([1, 2**22, 2**21, 2**21])),
        "refused",
    ),
    "chunks of 10^400": (put("chunk_grid", "configuration", "chunk_shape", [1, 10**400, 24, 18]), "refused"),
    "chunks of 2 GB": (
        lambda c: c.update(shape=[2, 1000, 1000, 2000], chunk_grid=_grid([1, 1000, 1000, 2000])),
        "any",
    ),
    "shape of 0": (put("shape", [2, 0, 48, 36]), "refused"),
    "no channels": (put("shape", [0, 16, 48, 36]), "refused"),
    "shape below 0": (put("shape", [2, -16, 48, 36]), "refused"),
    "shape in words": (put("shape", "big"), "refused"),
    "shape of fractions": (put("shape", [2, 16.5, 48, 36]), "refused"),
    "shape of nothing": (put("shape", []), "refused"),
    "shape too short": (put("shape", [16, 48, 36]), "refused"),
    "10^6 channels": (put("shape", [10**6, 16, 48, 36]), "any"),
    "10^9 channels": (put("shape", [10**9, 16, 48, 36]), "refused"),
    "chunks of 0": (put("chunk_grid", "configuration", "chunk_shape", [1, 0, 24, 18]), "refused"),
    "chunks below 0": (put("chunk_grid", "configuration", "chunk_shape", [1, -8, 24, 18]), "refused"),
    "chunks too few": (put("chunk_grid", "configuration", "chunk_shape", [8, 24]), "refused"),
    "fill value in words": (put("fill_value", "many"), "refused"),
    "fill value too large": (put("fill_value", 10**30), "refused"),
    "no codecs": (put("codecs", []), "refused"),
    "unknown codec": (put("codecs", [{"name": "../x", "configuration": {}}]), "refused"),
    "codec twice": (lambda c: c["codecs"].extend(c["codecs"]), "refused"),
    "zstd level absurd": (put("codecs", 1, "configuration", {"level": 10**9}), "any"),
    "shards of 0": (
        put("codecs", [{"name": "sharding_indexed", "configuration": {
            "chunk_shape": [1, 0, 1, 1], "codecs": [{"name": "bytes"}], "index_codecs": []}}]),
        "refused",
    ),
    "is a group": (put("node_type", "group"), "refused"),
    "format 9": (put("zarr_format", 9), "refused"),
    "key encoding unknown": (put("chunk_key_encoding", {"name": "hash"}), "refused"),
    "separator escapes": (put("chunk_key_encoding", {"name": "default", "configuration": {"separator": "/../"}}), "refused"),
}  # fmt: skip
_V2: dict[str, tuple[Change, str]] = {
    "v2 dtype object": (put("dtype", "|O"), "refused"),
    "v2 dtype text": (put("dtype", "<U99999999"), "refused"),
    "v2 dtype structured": (put("dtype", [["a", "<u2"], ["b", "<u2"]]), "refused"),
    "v2 filter pickle": (put("filters", [{"id": "pickle", "protocol": 2}]), "refused"),
    "v2 unknown compressor": (put("compressor", {"id": "\n"}), "refused"),
    "v2 order": (put("order", "Z"), "refused"),
    "v2 separator": (put("dimension_separator", "\\"), "any"),
    "v2 shape of 10^6 each way": (
        lambda c: c.update(shape=[2, 10**6, 10**6, 10**6], chunks=[1, 10**6, 10**6, 10**6]),
        "refused",
    ),
}


def _grid(chunks: list[int]) -> dict[str, Any]:
    return {"name": "regular", "configuration": {"chunk_shape": chunks}}


def _arrays() -> Iterator[Case]:
    for name, (change, expect) in _ARRAY.items():
        yield _json(name, "0/zarr.json", change, expect)
    for name, (change, expect) in _V2.items():
        yield _json(name, "0/.zarray", change, expect, 4)


def _collections() -> Iterator[Case]:
    for name, ome in {
        "plate of words": {"plate": "A"}, "plate of odd wells": {"plate": {"wells": [None, {}, {"path": "\n" * 10**6}]}},
        "plate that leads out": {"plate": {"wells": [{"path": "../../.."}]}}, "well of nothing": {"well": {"images": [{}]}},
        "labels alone": {"labels": ["x" * 10**6, 3, None]}, "container that leads out": {"bioformats2raw.layout": 3, "series": ["../x"]},
        "container of itself": {"bioformats2raw.layout": 3, "labels": []},
    }.items():  # fmt: skip
        yield _json(name, "zarr.json", put("attributes", "ome", ome), "refused")
    yield _json("label image", "zarr.json", put("attributes", "ome", "image-label", 3), "refused")


def _images() -> Iterator[Case]:
    def image(name: str, *steps: Any, expect: str = "any") -> Case:
        return _json(name, "zarr.json", put("attributes", "ome", "multiscales", *steps), expect)

    step = (0, "datasets", 0, "coordinateTransformations")
    for name, value in {
        "NaN": float("nan"), "infinite": float("inf"), "zero": 0, "below zero": -1, "words": "1",
        "nothing": None, "list": [1], "beyond float": 10**400,
    }.items():  # fmt: skip
        yield image(
            f"scale {name}",
            *step,
            0,
            "scale",
            1,
            value,
            expect="any" if name == "words" else "refused",
        )
    yield image("scale 1e308", *step, 0, "scale", 1, 1e308)
    yield image("scale 1e-320", *step, 0, "scale", 3, 1e-320)
    yield image("scale of different worlds", *step, 0, "scale", [1, 1e-9, 1, 1e9])
    for name, shift in {"NaN": float("nan"), "infinite": float("inf"), "vast": 1e300}.items():
        move = [
            {"type": "scale", "scale": [1.0] * 4},
            {"type": "translation", "translation": [0, shift, 0, 0]},
        ]
        yield image(f"translation {name}", *step, move)
    yield image(
        "transformation unknown", *step, [{"type": "affine", "affine": [[1]]}], expect="refused"
    )
    yield image(
        "transformation by path", *step, [{"type": "scale", "path": "../bait"}], expect="refused"
    )
    yield image("transformations in words", *step, "scale", expect="refused")
    yield image("axes in words", 0, "axes", "czyx", expect="refused")
    yield image("axes null", 0, "axes", None, expect="refused")
    yield image("axes without names", 0, "axes", [{}] * 4, expect="refused")
    yield image(
        "axes of odd names",
        0,
        "axes",
        [{"name": n} for n in ("\n", "z", "y", "x")],
        expect="refused",
    )
    yield image(
        "unit in a list",
        0,
        "axes",
        1,
        {"name": "z", "type": "space", "unit": ["mm"]},
        expect="refused",
    )
    yield image("datasets null", 0, "datasets", None, expect="refused")
    yield image("datasets a number", 0, "datasets", 3, expect="refused")
    yield image(
        "10000 levels",
        0,
        "datasets",
        [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1.0] * 4}]}]
        * 10000,
    )
    yield image("path a number", 0, "datasets", 0, "path", 0)
    yield image("multiscale null", 0, None, expect="refused")
    yield image("multiscale of itself", 0, "datasets", 0, "path", "", expect="refused")
    ome = ("attributes", "ome")
    for name, value in {"a list": [], "in words": "image", "null": None, "a number": 5}.items():
        yield _json(f"ome is {name}", "zarr.json", put(*ome, value), "refused")
        yield _json(
            f"multiscales is {name}", "zarr.json", put(*ome, "multiscales", value), "refused"
        )
        yield _json(f"omero is {name}", "zarr.json", put(*ome, "omero", value))
        yield _json(f"channels is {name}", "zarr.json", put(*ome, "omero", {"channels": value}))
    for name, text in ODD_NAMES.items():
        yield _json(
            f"channel named {name}",
            "zarr.json",
            put(*ome, "omero", "channels", 0, "label", text),
            "done",
        )
    yield _json(
        "colour in words",
        "zarr.json",
        put(*ome, "omero", "channels", 0, "color", "red; rm"),
        "done",
    )
    yield _json(
        "label a table", "zarr.json", put(*ome, "omero", "channels", 0, "label", {"a": [1]})
    )


def _paths() -> Iterator[Case]:
    for name, target in {
        "parent": "..", "sibling": f"../{_BAIT}/0", "up and back": f"../{_BAIT}/../v5.zarr/0",
        "absolute": "/{}/0", "backslash": f"..\\{_BAIT}\\0", "address": "http://127.0.0.1:9/x.zarr/0",
        "file address": "file:///{}/0", "here": ".", "nul": "0\0", "newline": "0\n1", "emoji": "\U0001f9e0",
        "long": "0/" * 3000, "encoded": f"%2e%2e/{_BAIT}/0", "nothing there": "9",
    }.items():  # fmt: skip

        def make(base: Path, folder: Path, target: str = target) -> list[str]:
            path = copied(base, folder, "v5.zarr")
            bait = folder / _BAIT
            copied(base, folder / "bait", "v5.zarr").rename(bait)
            place = target.format(str(bait)[1:]) if "{}" in target else target
            edit_json(
                path / "zarr.json",
                put("attributes", "ome", "multiscales", 0, "datasets", 0, "path", place),
            )
            return plan(path.name)

        yield Case(f"level's path: {name}", KIND, make, "refused")


def _links() -> Iterator[Case]:
    def link(file: str, target: str) -> Spoil:
        def spoil(path: Path) -> None:
            there = path / file
            if there.is_dir():
                there.rename(there.with_name("moved"))
            else:
                there.unlink(missing_ok=True)
            os.symlink(target, there)

        return spoil

    yield _case("level is a link to itself", link("0", "0"), "refused")
    yield _case("level is a link to its parent", link("0", "."), "refused")
    yield _case("zarr.json is a link to itself", link("zarr.json", "zarr.json"), "refused")
    yield _case(
        "array's zarr.json is a link to the group's", link("0/zarr.json", "../zarr.json"), "refused"
    )

    def out(file: str) -> Spoil:
        """Move a file or folder out of the group and leave a link to it."""

        def spoil(path: Path) -> None:
            bait = (path / file).rename(path.parent / "bait" / "moved")
            os.symlink(bait, path / file)

        return spoil

    for file in ("zarr.json", "0", "0/zarr.json", "0/c", "0/c/0/0/0/0"):
        yield _case(f"{file} is a link out", out(file), "refused")
    yield _case("level is a link within", link("0", "moved"), "done")
    yield _case("chunk is a link to itself", link("0/c/0/0/0/0", "0"), "refused")
    yield _case("chunk is a link without end", link("0/c/0/0/0/0", "/dev/zero"), "refused")
    yield _case("zarr.json is a link without end", link("zarr.json", "/dev/zero"), "refused")
    yield _case(
        "chunk is a folder", lambda path: _replace(path / "0/c/0/0/0/0", os.mkdir), "refused"
    )
    yield _case(
        "chunk is a pipe", lambda path: _replace(path / "0/c/0/0/0/0", os.mkfifo), "refused"
    )
    yield _case(
        "zarr.json is a pipe", lambda path: _replace(path / "zarr.json", os.mkfifo), "refused"
    )


def _replace(path: Path, make: Callable[[Path], None]) -> None:
    path.unlink()
    make(path)


def _deflated(wbits: int) -> bytes:
    """Return deflated zeros: one block repeated, since none refers to earlier ones."""
    packer = zlib.compressobj(9, zlib.DEFLATED, wbits)
    first = packer.compress(bytes(_BLOCK)) + packer.flush(zlib.Z_FULL_FLUSH)
    again = packer.compress(bytes(_BLOCK)) + packer.flush(zlib.Z_FULL_FLUSH)
    return first + again * (_HUGE // _BLOCK)


def _zstd_zeros(head: bytes) -> bytes:
    """Return a frame of blocks that are each 128 KB of one byte value."""
    runs = b"".join(struct.pack("<I", (1 << 17) << 3 | 2)[:3] + b"\0" for _ in range(_HUGE >> 17))
    return b"\x28\xb5\x2f\xfd" + head + runs + b"\x01\0\0"


def _chunks() -> Iterator[Case]:
    chunk = "0/c/0/0/0/0"

    def packed(codec: dict[str, Any], content: Callable[[], bytes]) -> Spoil:
        def spoil(path: Path) -> None:
            for other in (path / "0/c").rglob("*"):
                if other.is_file():
                    other.unlink()  # absent chunks are zeros
            edit_json(
                path / "0/zarr.json",
                put("codecs", [{"name": "bytes", "configuration": {"endian": "little"}}, codec]),
            )
            (path / chunk).write_bytes(content())

        return spoil

    gz, zstd = (
        {"name": "gzip", "configuration": {"level": 5}},
        {"name": "zstd", "configuration": {"level": 1, "checksum": False}},
    )
    blosc = {
        "name": "blosc",
        "configuration": {
            "typesize": 2,
            "cname": "lz4",
            "clevel": 5,
            "shuffle": "noshuffle",
            "blocksize": 0,
        },
    }
    yield _case("gzip bomb", packed(gz, lambda: _deflated(31)), "refused")
    yield _case("gzip bomb in gzip", packed(gz, lambda: gzip.compress(_deflated(31))), "refused")
    yield _case("zstd bomb", packed(zstd, lambda: _zstd_zeros(b"\0\x38")), "refused")
    yield _case(
        "zstd bomb that says its size",
        packed(zstd, lambda: _zstd_zeros(b"\xe0" + struct.pack("<Q", _HUGE))),
        "refused",
    )
    yield _case(
        "zstd claims 2^60",
        packed(zstd, lambda: b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", 1 << 60) + b"\x01\0\0"),
        "refused",
    )
    for name, size in {"2 GB": (1 << 31) - 32, "0": 0, "4 GB": (1 << 32) - 1}.items():
        head = struct.pack("<4B3I", 2, 1, 0, 2, size, 1 << 20, 40)
        yield _case(
            f"blosc claims {name}", packed(blosc, lambda head=head: head + bytes(24)), "refused"
        )
    for codec in (gz, zstd, blosc):
        yield _case(f"empty {codec['name']} chunk", packed(codec, lambda: b""), "refused")
        yield _case(
            f"{codec['name']} chunk of noise",
            packed(codec, lambda: b"\x1f\x8b\x08" + bytes(range(200))),
            "refused",
        )
    yield _case("raw chunk too long", packed({"name": "crc32c"}, lambda: bytes(100_000)), "refused")
    yield _case("zlib bomb of v2", _v2_bomb, "refused", 4)


def _v2_bomb(path: Path) -> None:
    content = json.loads((path / "0/.zarray").read_text("utf-8"))
    content["compressor"] = {"id": "zlib", "level": 1}
    (path / "0/.zarray").write_text(json.dumps(content))
    for file in (path / "0").rglob("*"):
        if file.is_file() and file.name != ".zarray":
            file.write_bytes(_deflated(15))
            break
