# ruff: noqa: E501  (tables of cases)
"""A build whose documents, units, stage files or bundle are damaged, and the commands that read it."""

import os
import shutil
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from malformed.cases import ODD_NAMES, SPOILT_JSON, Case, Change, copied, cut, edit_json, flip, put
from support.sealed_files import seal

PLAN, SURVEY, DONE, PHASES = "plan.json", "units/survey.json", "units/done.json", "phases.json"
MANIFEST, FILES = "bundle/manifest.json", "bundle/files.json"
# the commands that read each document
_READERS = {
    PLAN: ("units", "stage", "report", "check"), SURVEY: ("stage", "report", "units"), DONE: ("stage", "report"),
    PHASES: ("stage", "bundle"), MANIFEST: ("check", "serve"), FILES: ("check",),
    "bundle/channels/F/tileset.json": ("check",), "bundle/channels/F/volumes.json": ("check", "serve"),
    "bundle/channels/F/transfer2d.json": ("check",),
}  # fmt: skip
_HUGE = 10**30


def cases() -> Iterator[Case]:
    for file, commands in _READERS.items():
        for name, content in SPOILT_JSON.items():
            for command in commands[: 2 if name in ("empty", "nested", "long number") else 1]:
                yield _case(
                    f"{file} {name}",
                    command,
                    lambda out, f=file, c=content: (out / f).write_bytes(c),
                )
        yield _case(f"{file} cut", commands[0], lambda out, f=file: cut(out / f, 0.5))
        yield _case(
            f"{file} is a folder",
            commands[0],
            lambda out, f=file: ((out / f).unlink(), (out / f).mkdir()),
        )
        yield _case(
            f"{file} is a link to itself",
            commands[0],
            lambda out, f=file: _link(out / f, Path(f).name),
        )
        yield _case(f"{file} is lost", commands[0], lambda out, f=file: (out / f).unlink())
        for seed in range(2):
            yield _case(
                f"{file} with flipped bits {seed}",
                commands[0],
                lambda out, f=file, s=seed: flip(out / f, s, 4),
            )
    yield from _plans()
    yield from _units()
    yield from _stage_files()
    yield from _bundles()
    yield from _schedulers()


def _case(
    name: str, command: str, spoil: Callable[[Path], Any], expect: str = "any", kind: str = "build"
) -> Case:
    def make(base: Path, folder: Path) -> list[str]:
        out = copied(base, folder, "out")
        spoil(out)
        return arguments(command)

    return Case(f"{command}: {name}", kind, make, expect)


def arguments(command: str) -> list[str]:
    if command == "serve":
        return ["serve", "out", "--port", "0"]
    workers = [] if command == "report" else ["--workers", "0"]
    return [
        *command.replace("check deep", "check --deep").split()[:1],
        "out",
        *workers,
        *(["--deep"] if "deep" in command else []),
    ]


def _link(path: Path, target: str) -> None:
    path.unlink()
    os.symlink(target, path)


def _edited(name: str, command: str, file: str, change: Change, expect: str = "any") -> Case:
    return _case(name, command, lambda out: edit_json(out / file, change), expect)


def _plans() -> Iterator[Case]:
    escape = "../../bait/x"
    for name, change in {
        "tile's id escapes": put("tiles", 0, "id", escape), "tile's id empty": put("tiles", 0, "id", ""),
        "tile's ids alike": put("tiles", 0, "id", "r0_c1"), "tile beyond the region": put("tiles", 0, "stop", [16, 48, 10**6]),
        "tile turned": put("tiles", 0, "start", [99, 99, 99]), "tile of 10^30": put("tiles", 0, "stop", [_HUGE] * 3),
        "no tiles": put("tiles", []), "no channels": put("channels", []), "channel's index beyond": put("channels", 0, "index", 99),
        "channel's index below 0": put("channels", 0, "index", -1), "channel's index 10^30": put("channels", 0, "index", _HUGE),
        "channel's name empty": put("channels", 0, "name", ""), "channel's names alike": put("channels", 0, "name", "G"),
        "channel's source escapes": put("channels", 0, "source", "../bait"), "colour 1e999": put("channels", 0, "color", [float("inf")] * 3),
        "colour of 2": put("channels", 0, "color", [1, 2]), "source lost": put("source", "/nowhere.zarr"), "source the bait": put("source", "bait"),
        "source empty": put("source", ""), "source an address": put("source", "http://127.0.0.1:9/x.zarr"), "level 7": put("level", 7),
        "level 10^30": put("level", _HUGE), "spacing 0": put("spacing_um", [0, 1, 1]), "spacing NaN": put("spacing_um", [float("nan"), 1, 1]),
        "spacing 1e300": put("spacing_um", [1e300] * 3), "origin inf": put("origin_um", [float("inf"), 0, 0]), "halo 10^9": put("halo", [10**9] * 3),
        "halo below 0": put("halo", [-5, -5, -5]), "region empty": put("region", "stop", [0, 0, 0]), "region 10^6 each way": put("region", "stop", [10**6] * 3),
        "placement NaN": put("placement", [[float("nan")] * 4] * 4), "placement singular": put("placement", [[0.0] * 4] * 4), "placement of 3": put("placement", [[1.0] * 3] * 3),
        "settings empty": put("settings", {}), "settings of another kind": put("settings", []), "setting unknown": put("settings", "plan", {"x": 1}),
        "setting turned": put("settings", "window", {"low_percentile": 99.0, "high_percentile": 1.0}), "version 99": put("version", 99),
        "format of another": put("format", "else"), "modality a list": put("modality", [1]), "fingerprint of another": put("fingerprint", "0" * 64),
        "fingerprint odd": put("fingerprint", "\n"), "smoothing inf": put("settings", "surface", {"smoothing_um": float("inf")}),
        "smoothing 1e9": put("settings", "surface", "smoothing_um", 1e9), "LODs of 10^9": put("settings", "lod", {"levels": 10**9}),
    }.items():  # fmt: skip
        yield _edited(name, "units", PLAN, _sealed(change))
    for name, text in ODD_NAMES.items():
        yield _edited(f"plan's name {name}", "report", PLAN, _sealed(put("name", text)))
        yield _edited(
            f"channel named {name}", "units", PLAN, _sealed(put("channels", 0, "name", text))
        )


def _units() -> Iterator[Case]:
    for name, change in {
        "window turned": put("channels", "F", "statistics", "window", [9, 1]), "window NaN": put("channels", "F", "statistics", "window", [float("nan")] * 2),
        "histogram short": put("channels", "F", "statistics", "histogram", [1]), "iso of 1e999": put("channels", "F", "iso", {"r0_c0": float("inf")}), "look lost": put("channels", "F", "appearance", {}),
        "look named odd": put("channels", "F", "appearance", "name", "\n"), "look's window turned": put("channels", "F", "appearance", "window", [5, 5]),
        "look's functions": put("channels", "F", "appearance", "transfer_functions", {"../x": [[0, 0]]}), "look's functions empty": put("channels", "F", "appearance", "transfer_functions", {}),
        "look's colour": put("channels", "F", "appearance", "color", [1e30, -1, 0]),
    }.items():  # fmt: skip
        yield _edited(f"survey's {name}", "stage", SURVEY, _sealed(change))
    for name, key in {"escapes": "../../../bait", "empty": "", "of another": "0" * 20}.items():
        yield _edited(
            f"key that {name}", "stage", DONE, _sealed(lambda c, k=key: dict.fromkeys(c, k))
        )
    for file in ("unit.json", "voxels.npz", "lod0.npz", "lod1.npz"):
        for way, spoil in {
            "cut": lambda p: cut(p, 0.6), "empty": lambda p: p.write_bytes(b""), "flipped": lambda p: flip(p, 3, 40), "lost": lambda p: p.unlink(),
            "its head flipped": lambda p: flip(p, 5, 10, 0, 120),
        }.items():  # fmt: skip
            for command in ("stage", "report") if way != "lost" else ("units", "stage"):
                yield _case(
                    f"{file} {way}",
                    command,
                    lambda out, f=file, s=spoil: _every(out / "units/r0_c0/F", f, s),
                )
    head = b"\x93NUMPY\x01\x00v\x00"
    for name, text in {
        "claims 10^18": "{'descr': '|u1', 'fortran_order': False, 'shape': (1000000, 1000000, 1000000), }",
        "of objects": "{'descr': '|O', 'fortran_order': False, 'shape': (9,), }",
        "of another type": "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2, 2), }",
        "of code": "__import__('os').mkdir('owned')",
        "flat": "{'descr': '|u1', 'fortran_order': False, 'shape': (64,), }",
    }.items():
        content = head + text.encode().ljust(117) + b"\n" + bytes(64)
        yield _case(
            f"voxels.npz {name}",
            "stage",
            lambda out, c=content: _every(
                out / "units/r0_c0/F", "voxels.npz", lambda p: p.write_bytes(c)
            ),
        )
    for name, change in {
        "lods absurd": put("lods", [{}] * 3), "lods of 10^30": put("lods", 0, "triangles", _HUGE), "files escape": put("files", {"../../../bait/secret.txt": 22}),
        "volume of 10^6 each way": put("volume", [10**6] * 3), "reason of lines": put("reason", "a\nb"), "distance NaN": put("lods", 0, "distance_um", float("nan")),
    }.items():  # fmt: skip
        yield _case(
            f"unit.json: {name}",
            "stage",
            lambda out, c=change: _every(
                out / "units/r0_c0/F", "unit.json", lambda p: edit_json(p, _sealed(c))
            ),
        )


def _sealed(change: Change) -> Change:
    """Return a change after which the file still states its own hash, so that it looks undamaged."""

    def sealed(content: Any) -> Any:
        changed = change(content)
        return seal(content if changed is None else changed)

    return sealed


def _every(folder: Path, name: str, spoil: Callable[[Path], Any]) -> None:
    found = sorted(folder.rglob(name))
    assert found, f"no {name} in {folder}"
    for path in found:
        spoil(path)


def _stage_files() -> Iterator[Case]:
    for suffix in (".vdb", ".exr", ".usdc", ".usda", ".png"):
        ways: dict[str, Callable[[Path], Any]] = {
            "cut": lambda p: cut(p, 0.5), "empty": lambda p: p.write_bytes(b""), "of noise": lambda p: p.write_bytes(bytes(range(256)) * 8),
            "flipped": lambda p: flip(p, 1, 30), "its head flipped": lambda p: flip(p, 2, 12, 0, 200), "its head flipped again": lambda p: flip(p, 7, 12, 0, 200),
            "endless": lambda p: _link(p, "/dev/zero"),
        }  # fmt: skip
        for way, spoil in ways.items():
            for command in ("bundle", "check"):
                yield _case(
                    f"{suffix} {way}",
                    command,
                    lambda out, x=suffix, s=spoil: _some(out / "stage", x, s),
                    kind="stage files",
                )
    counts = {"-1": -1, "0": 0, "2^31": 0x7FFFFFFF}
    for name, count in counts.items():
        yield _case(
            f".vdb of {name} grids",
            "check",
            lambda out, c=count: _some(out / "stage", ".vdb", lambda p: _patch(p, 21 + 36, c)),
            kind="stage files",
        )


def _patch(path: Path, place: int, value: int) -> None:
    content = bytearray(path.read_bytes())
    struct.pack_into("<i", content, place, value)
    path.write_bytes(content)


def _some(folder: Path, suffix: str, spoil: Callable[[Path], Any]) -> None:
    """Damage the first file of a kind, if there is one."""
    for path in sorted(folder.rglob(f"*{suffix}"))[:1]:
        spoil(path)


def _bundles() -> Iterator[Case]:
    for name, path in {
        "parent": "../../bait/secret.txt",
        "absolute": "/etc/hostname",
        "backslash": "..\\..\\bait\\secret.txt",
        "address": "http://127.0.0.1:9/x.json",
        "empty": "",
        "folder": "channels",
        "nul": "a\0b",
        "long": "x/" * 3000,
        "here": ".",
    }.items():
        for place in ("volumes", "tileset", "transfer_functions_2d"):
            steps = (
                ("channels", 0, place, "file", "path")
                if place == "transfer_functions_2d"
                else ("channels", 0, place, "path")
            )
            lie = _sealed(put(*steps, path))
            yield _edited(f"manifest's {place}: {name}", "check", MANIFEST, lie)
        yield _edited(
            f"volume's file: {name}",
            "check",
            "bundle/channels/F/volumes.json",
            put("volumes", 0, "file", "path", path),
        )
        yield _edited(
            f"tileset's uri: {name}",
            "check",
            "bundle/channels/F/tileset.json",
            lambda c, p=path: _uri(c["root"], p),
        )
        yield _edited(
            f"served volume's file: {name}",
            "serve",
            "bundle/channels/F/volumes.json",
            put("volumes", 0, "file", "path", path),
        )
        yield _edited(
            f"file list: {name}",
            "check",
            FILES,
            lambda c, p=path: {**c, p: {"bytes": 1, "sha256": "0" * 64}},
        )
    for suffix in (".glb", ".ktx2"):
        for way, spoil in {
            "cut": lambda p: cut(p, 0.5),
            "empty": lambda p: p.write_bytes(b""),
            "flipped": lambda p: flip(p, 1, 20),
            "its head flipped": lambda p: flip(p, 2, 8, 0, 100),
            "length of 2^32": lambda p: _patch(p, 8, -1),
            "is a link out": lambda p: _link(p, "../../../../bait/secret.txt"),
        }.items():
            for command in ("check", "check deep"):
                yield _case(
                    f"{suffix} {way}",
                    command,
                    lambda out, x=suffix, s=spoil: _some(out / "bundle", x, s),
                    "refused",
                    "bundle",
                )
    for name, change in {
        "ring of children": lambda c: c["root"].__setitem__("children", [c["root"].copy()] * 2),
        "nested children": lambda c: _nest(c),
        "error NaN": put("root", "geometricError", float("nan")),
        "error in words": put("root", "geometricError", "big"),
        "root lost": lambda c: c.pop("root") and None,
        "content a list": put("root", "content", []),
        "box of 3": put("root", "boundingVolume", {"box": [1, 2, 3]}),
    }.items():
        yield _edited(f"tileset: {name}", "check", "bundle/channels/F/tileset.json", change)


def _uri(tile: Any, path: str) -> None:
    if "content" in tile:
        tile["content"]["uri"] = path
    for child in tile.get("children", ()):
        _uri(child, path)


def _nest(content: Any) -> None:
    tile = content["root"]
    for _ in range(300):
        tile["children"] = [{"geometricError": 0, "boundingVolume": tile["boundingVolume"]}]
        tile = tile["children"][0]


def _schedulers() -> Iterator[Case]:
    for name, content in {
        **SPOILT_JSON,
        "address of nobody": b'{"address": "tcp://127.0.0.1:9"}',
        "address odd": b'{"address": "\\n"}',
        "address a list": b'{"address": [1]}',
        "without address": b'{"workers": {}}',
        "address of a port beyond": b'{"address": "tcp://127.0.0.1:99999999"}',
    }.items():

        def make(base: Path, folder: Path, content: bytes = content) -> list[str]:
            shutil.rmtree(copied(base, folder, "out") / "units")
            (folder / "s.json").write_bytes(content)
            return ["units", "out", "--scheduler", "s.json"]

        if name != "address of nobody":  # the command waits for that address
            yield Case(f"scheduler file {name}", "cluster", make, "refused")
    for text in (
        "tcp://",
        "tcp://[",
        "nowhere",
        "tcp://x y",
        "ftp://a:1",
        "tcp://\u202e:1",
        "../bait/secret.txt",
    ):

        def address(base: Path, folder: Path, text: str = text) -> list[str]:
            shutil.rmtree(copied(base, folder, "out") / "units")
            return ["units", "out", "--scheduler", text]

        yield Case(f"scheduler {text}", "cluster", address, "refused")
