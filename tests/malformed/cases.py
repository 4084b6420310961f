"""Cases of malformed input, and functions that damage files in the same way each time."""

import json
import random
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Change = Callable[[Any], Any]
# texts that are hard to show, or dangerous as paths
ODD_NAMES = {
    "empty": "",
    "blank": "   ",
    "slash": "a/b",
    "dots": "..",
    "escape": "../../bait/secret",
    "backslash": "a\\..\\b",
    "colon": "C:\\x:y",
    "quote": "a\"b'c",
    "newline": "a\nstereocell: b",
    "nul": "a\0b",
    "bell": "a\x1b[31mb\x07",
    "emoji": "\U0001f9e0\u200d\U0001f52c",
    "right to left": "\u202eabc\u05d0\u05d1",
    "combining": "e\u0301\u0300" * 50,
    "long": "x" * 3000,
    "markup": "<script>alert(1)</script>[red]",
    "surrogate": "\ud800x",
    "percent": "%00%2e%2e/{0}$HOME`id`",
}


@dataclass(frozen=True, slots=True)
class Case:
    """One malformed input.

    make    called with the folder of intact files (base.py) and an empty one, in which the command
            then runs: puts the input there and returns the command's arguments; OUT is `out`
    expect  `refused`, `done`, or `any`: either of them, without a fault
    """

    name: str
    kind: str
    make: Callable[[Path, Path], list[str]]
    expect: str = "any"


def plan(source: str, *flags: str) -> list[str]:
    return ["plan", source, "-o", "out", *flags]


def slices(source: str, *flags: str) -> list[str]:
    return ["slices", source, "-o", "out", *flags]


def copied(base: Path, folder: Path, name: str) -> Path:
    """Copy an intact file or folder; return the copy."""
    source, target = base / name, folder / name
    if source.is_dir():
        shutil.copytree(source, target, symlinks=True)
    else:
        shutil.copy2(source, target)
    return target


def edit_json(file: Path, change: Change) -> None:
    """Change the content of a JSON file; `change` may return another one."""
    content = json.loads(file.read_text("utf-8"))
    changed = change(content)
    file.write_text(json.dumps(content if changed is None else changed))


def put(*steps_and_value: Any) -> Change:
    """Return a change of one place: put("a", 0, "b", value) makes content["a"][0]["b"] = value."""
    *steps, last, value = steps_and_value

    def change(content: Any) -> None:
        for step in steps:
            content = content[step]
        content[last] = value

    return change


def cut(file: Path, share: float) -> None:
    """Keep this share of a file, 0 to 1."""
    content = file.read_bytes()
    file.write_bytes(content[: int(len(content) * share)])


def flip(file: Path, seed: int, count: int = 3, start: int = 0, stop: int | None = None) -> None:
    """Flip `count` bits in a range of bytes of a file."""
    content = bytearray(file.read_bytes())
    chance = random.Random(seed)
    stop = len(content) if stop is None else min(stop, len(content))
    for _ in range(count):
        content[chance.randrange(start, stop)] ^= 1 << chance.randrange(8)
    file.write_bytes(content)


def nested(depth: int = 100_000) -> bytes:
    """Return JSON of nested lists."""
    return b"[" * depth + b"]" * depth


# bytes that are not JSON, or not a document of StereoCell
SPOILT_JSON: dict[str, bytes] = {
    "empty": b"",
    "null": b"null",
    "list": b"[]",
    "number": b"1e999",
    "nested": nested(),
    "no text": b"\xff\xfe{\x00}",
    "long number": b'{"version": ' + b"9" * 5000 + b"}",
    "NaN": b'{"a": NaN}',
    "surrogate": b'{"\\ud800": "\\udfff"}',
    "twice": b'{"a": 1}{"a": 1}',
}
