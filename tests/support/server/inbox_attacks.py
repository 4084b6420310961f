"""Attacks on an inbox by names, lists, addresses, offsets, bodies and archives, with the answers.

    PYTHONPATH=tests .venv/bin/python -m support.server.inbox_attacks

prints the number of attacks of each kind. tests/inbox/test_attacks.py runs all of them.
"""

import gzip
import io
import json
import stat
import tarfile
import zipfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

MARK = "PATIENT-NAME"  # part of requests; no answer, file or line may repeat it
ITEM = "ITEM"  # in a path, stands for the ID of a begun upload of SIZE bytes
SIZE = 1000


@dataclass(frozen=True, slots=True)
class Request:
    """One request that must be refused in one line, with one of these statuses."""

    name: str
    method: str
    path: str
    body: bytes = b""
    headers: dict[str, str] = field(default_factory=dict)
    right: tuple[int, ...] = (400,)


@dataclass(frozen=True, slots=True)
class Archive:
    """An archive whose item must fail with a line that begins like this."""

    name: str
    file: str
    content: bytes
    line: str = "archive: "


def _announced(name: str, content: Any, *right: int) -> Request:
    body = content if isinstance(content, bytes) else json.dumps(content).encode()
    return Request(name, "POST", "/items", body, right=right or (400,))


def names() -> Iterator[Request]:
    """Yield names of files that are paths, or that are not names."""
    for about, name in {
        "dots": f"../{MARK}.dcm",
        "dots inside": f"a/../../{MARK}.dcm",
        "dots at the end": f"{MARK}/..",
        "one dot": f"./{MARK}.dcm",
        "one dot inside": f"{MARK}/./b.dcm",
        "three dots": f".../{MARK}",
        "a dot and a space": f". /{MARK}",
        "spaces": f"   /{MARK}",
        "absolute": f"/etc/{MARK}",
        "absolute twice": f"//host/{MARK}",
        "a drive": f"C:/{MARK}",
        "a drive's own folder": f"c:{MARK}",
        "backslashes": f"..\\{MARK}",
        "a backslash inside": f"a\\{MARK}",
        "a share": f"\\\\host\\{MARK}",
        "NUL": f"{MARK}\0.dcm",
        "a line break": f"{MARK}\n.dcm",
        "a carriage return": f"{MARK}\r.dcm",
        "a tab": f"{MARK}\t.dcm",
        "escape": f"\x1b[2J{MARK}",
        "turned around": f"{MARK}\u202egnp.exe",
        "a mark of no width": f"{MARK}\u200b.dcm",
        "a byte order mark": f"\ufeff{MARK}",
        "half a character": f"{MARK}\ud800.dcm",
        "a line separator": f"{MARK}\u2028.dcm",
        "an empty name": "",
        "an empty folder": f"a//{MARK}",
        "a folder alone": f"{MARK}/",
        "a slash": "/",
        "1001 characters": MARK + "a" * 990,
        "a part of 256 bytes": MARK + "a" * 250,
        "umlauts of 300 bytes": "\u00e4" * 150,
        "32 folders": "a/" * 32 + MARK,
        "a number": 7,
        "true": True,
        "null": None,
        "a list": [MARK],
        "an object": {"name": MARK},
    }.items():
        yield _announced(f"name: {about}", {"files": [[name, SIZE]]})
    for about, pair in {
        "twice": ("a.dcm", "a.dcm"),
        "by case": ("a.dcm", "A.DCM"),
        "by case of a folder": ("a/b.dcm", "A/b.dcm"),
        "by accents": ("\u00e4.dcm", "a\u0308.dcm"),
        "sharp s": ("stra\u00dfe", "STRASSE"),
        "a file and a folder": ("a", "a/b.dcm"),
        "a file and a folder by case": ("A/b.dcm", "a"),
    }.items():
        files = [[one, SIZE] for one in pair]
        yield _announced(f"names: {about}", {"files": files})


def lists() -> Iterator[Request]:
    """Yield announcements of no files, of too many, or of other things than files."""
    many = [[f"{k}", 1] for k in range(301)]
    for about, content, right in (
        ("no JSON", b"{", 400),
        ("nothing", b"", 400),
        ("no UTF-8", b'{"files": [["\xff", 1]]}', 400),
        ("a deep list", b"[" * 100_000, 400),
        ("NaN", b'{"files": [["a", NaN]]}', 400),
        ("infinity", b'{"files": [["a", Infinity]]}', 400),
        ("a number of 5000 digits", b'{"files": [["a", ' + b"9" * 5000 + b"]]}", 400),
        ("null", None, 400),
        ("a list", [["a", 1]], 400),
        ("a text", "files", 400),
        ("an empty object", {}, 400),
        ("another key", {"path": "/etc/passwd"}, 400),
        ("both", {"files": [["a", 1]], "address": "https://example.org/a.zarr"}, 400),
        ("one more key", {"files": [["a", 1]], "id": "../x"}, 400),
        ("no files", {"files": []}, 400),
        ("files as an object", {"files": {"a": 1}}, 400),
        ("a file as a text", {"files": ["a"]}, 400),
        ("a file of three", {"files": [["a", 1, "/etc/passwd"]]}, 400),
        ("a file without a size", {"files": [["a"]]}, 400),
        ("no bytes", {"files": [["a", 0], ["b", 0]]}, 400),
        ("a size below 0", {"files": [["a", -1]]}, 400),
        ("sizes that cancel out", {"files": [["a", 10**12], ["b", -(10**12)]]}, 400),
        ("a size with a fraction", {"files": [["a", 1.5]]}, 400),
        ("a size as a text", {"files": [["a", "1"]]}, 400),
        ("a size of true", {"files": [["a", True]]}, 400),
        ("a size of null", {"files": [["a", None]]}, 400),
        ("a petabyte", {"files": [["a", 10**15]]}, 413),
        ("a size beyond 64 bits", {"files": [["a", 2**80]]}, 413),
        ("many files", {"files": many}, 413),
        ("an address of null", {"address": None}, 400),
        ("an address of 7", {"address": 7}, 400),
        ("an empty address", {"address": ""}, 400),
        ("a long address", {"address": "https://example.org/" + "a" * 2000}, 400),
    ):
        yield _announced(f"list: {about}", content, right)
    huge = {"Content-Length": str(1 << 40)}
    yield Request("list: a terabyte", "POST", "/items", headers=huge, right=(413,))


def addresses() -> Iterator[Request]:
    """Yield addresses that a person at another machine may not make this machine ask."""
    inside = (
        *("127.0.0.1", "127.1", "127.0.1", "2130706433", "0x7f000001", "0x7f.0.0.1", "0177.0.0.1"),
        *("127.0.0.1:8000", "127.255.255.254", "0.0.0.0", "0", "localhost", "LOCALHOST"),
        *("localhost.", "[::1]", "[::]", "[0:0:0:0:0:0:0:1]", "[::ffff:127.0.0.1]"),
        *("[::ffff:7f00:1]", "[::127.0.0.1]", "10.0.0.1", "10.255.255.255", "172.16.0.1"),
        *("172.31.255.255", "192.168.0.1", "192.168.1.1:8080", "169.254.169.254"),
        *("[fe80::1]", "[fc00::1]", "[fd00:ec2::254]", "100.64.0.1", "192.0.0.1"),
        *("198.18.0.1", "224.0.0.1", "255.255.255.255", "240.0.0.1", "[ff02::1]"),
        *("[64:ff9b::7f00:1]", "[64:ff9b::a00:1]", "[2002:7f00:1::]", "[2002:c0a8:1::]"),
        *("[2001:0:0:0:0:0:80ff:fffe]", "inside.example", "both.example"),
    )
    for host in inside:
        yield _announced(f"address: {host}", {"address": f"http://{host}/{MARK}.ome.zarr"})
    for about, text in {
        "a path": f"/etc/{MARK}",
        "a name": f"{MARK}.nii.gz",
        "a home": f"~/{MARK}",
        "file": f"file:///etc/{MARK}",
        "file, by case": f"FILE:///etc/{MARK}",
        "file by localhost": f"file://localhost/etc/{MARK}",
        "local": f"local:///etc/{MARK}",
        "ftp": f"ftp://ftp.example/{MARK}",
        "sftp": f"sftp://host/{MARK}",
        "smb": f"smb://host/{MARK}",
        "gs": f"gs://bucket/{MARK}",
        "memory": f"memory://{MARK}",
        "data": f"data:text/plain,{MARK}",
        "a chain": f"simplecache::file:///etc/{MARK}",
        "a zip in a chain": f"zip://{MARK}::https://example.org/a.zip",
        "reference": f"reference://{MARK}",
        "github": f"github://org:repo@/{MARK}",
        "javascript": f"javascript:alert('{MARK}')",
        "no host": f"https:///{MARK}",
        "a user": f"https://user:{MARK}@example.org/a.zarr",
        "a host as a user": f"https://example.org@127.0.0.1/{MARK}",
        "a backslash": f"https://example.org\\@127.0.0.1/{MARK}",
        "a space": f"https://example.org /{MARK}",
        "a line break": f"https://example.org/\r\nHost: {MARK}",
        "NUL": f"https://example.org/\0{MARK}",
        "port 0": f"https://example.org:0/{MARK}",
        "port 99999": f"https://example.org:99999/{MARK}",
        "a port of letters": f"https://example.org:http/{MARK}",
        "an open bracket": f"https://[::1/{MARK}",
        "full-width digits": f"http://\uff11\uff12\uff17.0.0.1/{MARK}",
        "circled digits": f"http://\u2460\u2461\u2466.0.0.1/{MARK}",
        "a dot of another script": f"http://127\u30020.0.1/{MARK}",
        "a zone": f"http://[fe80::1%25eth0]/{MARK}",
        "s3 without a bucket": f"s3:///{MARK}",
        "s3 without a key": "s3://bucket",
        "s3 with a user": f"s3://key:{MARK}@bucket/a.zarr",
        "s3 by a number": f"s3://127.0.0.1/{MARK}",
        "s3 with a port": f"s3://bucket:9000/{MARK}",
        "s3 with dots": f"s3://bucket/../{MARK}",
        "s3 with a query": f"s3://bucket/a.zarr?endpoint_url=http://127.0.0.1/{MARK}",
        "s3 by case": f"s3://BUCKET/{MARK}",
        "s3a": f"s3a://bucket/{MARK}",
    }.items():
        yield _announced(f"address: {about}", {"address": text})


def pieces() -> Iterator[Request]:
    """Yield pieces with a wrong or malformed offset, or of a wrong length."""
    path = f"/items/{ITEM}/bytes"
    for about, offset, right in (
        ("none", None, 400),
        ("empty", "", 400),
        ("below 0", "-1", 400),
        ("a fraction", "0.0", 400),
        ("in hex", "0x0", 400),
        ("with a sign", "+0", 400),
        ("a word", "end", 400),
        ("Arabic digits", "\u0660".encode().decode("latin-1"), 400),
        ("19 digits", "1" * 19, 400),
        ("5000 digits", "1" * 5000, 400),
        ("behind what has come", "1", 409),
        ("at the end", str(SIZE), 409),
        ("behind the end", str(SIZE + 1), 409),
        ("64 bits", str(2**59), 409),
    ):
        headers = {} if offset is None else {"Upload-Offset": offset}
        yield Request(f"offset: {about}", "PATCH", path, b"x", headers, (right,))
    at = {"Upload-Offset": "0"}
    more = bytes(SIZE + 1)
    yield Request("piece: longer than announced", "PATCH", path, more, at, (413,))
    for about, headers, right in (
        ("5 MB", {"Content-Length": str(5 << 20)}, (413,)),
        ("a length of 30 digits", {"Content-Length": "1" * 30}, (400, 413)),
        ("a length of -1", {"Content-Length": "-1"}, (400,)),
        ("a length of letters", {"Content-Length": "x"}, (400,)),
        ("two lengths", {"Content-Length": "1, 2"}, (400,)),
        ("in chunks", {"Transfer-Encoding": "chunked"}, (411,)),
        ("gzip", {"Transfer-Encoding": "gzip"}, (400, 411, 501)),
    ):
        yield Request(f"piece: {about}", "PATCH", path, headers={**at, **headers}, right=right)
    for method in ("POST", "PUT", "GET", "DELETE"):
        yield Request(f"piece: by {method}", method, path, headers=at, right=(405, 413))


def bodies() -> Iterator[Request]:
    """Yield choices and commands that make no sense."""
    path = f"/items/{ITEM}/choices"
    for about, content in {
        "of an upload that has begun": {"title": "x"},
        "no object": [],
        "another key": {"config": f"/etc/{MARK}"},
        "a source": {"source": f"/etc/{MARK}"},
        "labels": {"labels": {"a": f"/etc/{MARK}"}},
        "a preset's file": {"preset": f"/tmp/{MARK}.toml"},
        "a preset above": {"preset": f"../{MARK}"},
        "a preset of null": {"preset": None},
        "channels as a text": {"channels": "0"},
        "channels of numbers": {"channels": [0]},
        "channels below 0": {"channels": ["-1"]},
        "a flag as a channel": {"channels": ["--config"]},
        "channels twice": {"channels": ["0", "0"]},
        "a channel of many digits": {"channels": ["9" * 5000]},
        "many channels": {"channels": [str(k) for k in range(1001)]},
        "a series of 0": {"series": "0"},
        "a series in words": {"series": "list"},
        "a series as a number": {"series": 1},
        "a background": {"background": "blue"},
        "a spacing of two": {"spacing_um": [1, 1]},
        "a spacing of 0": {"spacing_um": [0, 1, 1]},
        "a spacing below 0": {"spacing_um": [-1, 1, 1]},
        "a huge spacing": {"spacing_um": [1e300, 1, 1]},
        "a spacing as a text": {"spacing_um": "1,1,1"},
        "a title of 200": {"title": "a" * 200},
        "a title with escapes": {"title": "\x1b]0;x\x07"},
        "a title as a list": {"title": ["a"]},
    }.items():
        body = json.dumps(content).encode()
        yield Request(f"choices: {about}", "PUT", path, body, right=(400, 409))
    huge = json.dumps({"title": "a" * (1 << 17)}).encode()
    yield Request("choices: 128 KiB", "PUT", path, huge, right=(413,))
    for about, content in {
        "a list": [],
        "a text": "yes",
        "keep as a text": {"keep_upload": "yes"},
        "another place": {"out": f"/tmp/{MARK}"},
        "of an upload that has begun": {},
    }.items():
        body = json.dumps(content).encode()
        path = f"/items/{ITEM}/build"
        yield Request(f"build: {about}", "POST", path, body, right=(400, 409))
    for verb in ("look", "pause", "continue", "cancel"):
        yield Request(f"{verb}: too early", "POST", f"/items/{ITEM}/{verb}", right=(409,))


def paths() -> Iterator[Request]:
    """Yield paths that lead to no item, or beside an item."""
    none = "0" * 16
    for about, method, path, right in (
        ("no item", "GET", f"/items/{none}/understood", 404),
        ("no item to delete", "DELETE", f"/items/{none}", 404),
        ("all items", "DELETE", "/items", 404),
        ("all items, by a slash", "DELETE", "/items/", 404),
        ("the list of items", "GET", "/items", 404),
        ("dots as an item", "DELETE", "/items/..", 404),
        ("dots as an item, encoded", "DELETE", "/items/%2e%2e", 404),
        ("an item in capitals", "GET", f"/items/{'A' * 16}/understood", 404),
        ("a long item", "GET", f"/items/{'0' * 17}/understood", 404),
        ("the upload", "GET", f"/items/{ITEM}/upload/names.json", 404),
        ("the upload by slices", "GET", f"/items/{ITEM}/slices/../upload/names.json", 404),
        ("the upload, encoded", "GET", f"/items/{ITEM}/slices/%2e%2e/upload/names.json", 404),
        ("the upload by a view", "GET", f"/items/{ITEM}/view/../upload/names.json", 404),
        ("the queue by slices", "GET", f"/items/{ITEM}/slices/../../inbox.json", 404),
        ("slices too early", "GET", f"/items/{ITEM}/slices/z.png", 404),
        ("a view too early", "GET", f"/items/{ITEM}/view/", 404),
        ("the build", "GET", f"/items/{ITEM}/out/plan.json", 404),
        ("the queue", "GET", "/inbox.json", 404),
        ("the queue above", "GET", "/../inbox.json", 404),
        ("the queue, encoded", "GET", "/%2e%2e/box/inbox.json", 404),
        ("a worker for all pages", "GET", "/sw.js", 404),
        ("another page", "GET", "/index.html", 404),
        ("an unknown verb", "POST", f"/items/{ITEM}/export", 404),
        ("upload to a file", "PUT", "/inbox.html", 405),
        ("delete a file", "DELETE", "/inbox.html", 405),
        ("post to the page", "POST", "/", 405),
        ("trace", "TRACE", "/items", 404),
        ("the events by POST", "POST", "/events", 405),
    ):
        yield Request(f"path: {about}", method, path, right=(right,))


def foreign() -> Iterator[Request]:
    """Yield requests that another page makes a browser send."""
    body = json.dumps({"address": "https://example.org/a.zarr"}).encode()
    for about, headers in {
        "another origin": {"Origin": "https://evil.example"},
        "another port": {"Origin": "http://localhost:1"},
        "no origin at all": {"Origin": "null"},
        "another site": {"Sec-Fetch-Site": "cross-site"},
        "the same site": {"Sec-Fetch-Site": "same-site"},
        "a form of another page": {
            "Sec-Fetch-Site": "cross-site",
            "Sec-Fetch-Mode": "navigate",
            "Sec-Fetch-Dest": "document",
        },
        "another name": {"Host": "evil.example"},
        "a name that points here": {"Host": "127.0.0.1.evil.example"},
    }.items():
        for method, path in (("POST", "/items"), ("DELETE", f"/items/{ITEM}")):
            sent = body if method == "POST" else b""
            name = f"page: {about}, {method}"
            yield Request(name, method, path, sent, {"Accept": "*/*", **headers}, (403,))


# --- archives


def _zip(
    *members: tuple[str, bytes], change: Callable[[zipfile.ZipInfo], None] | None = None
) -> bytes:
    held = io.BytesIO()
    with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members:
            info = zipfile.ZipInfo(name)
            info.filename = name  # unchanged, because ZipInfo() would clean the name
            info.compress_type = zipfile.ZIP_DEFLATED
            if change is not None:
                change(info)
            archive.writestr(info, content)
    return held.getvalue()


def _tar(*infos: tarfile.TarInfo, packing: str = "w") -> bytes:
    held = io.BytesIO()
    with tarfile.open(fileobj=held, mode=packing) as archive:  # type: ignore[call-overload]
        for info in infos:
            archive.addfile(info, io.BytesIO(bytes(info.size)))
    return held.getvalue()


def _member(
    name: str, kind: bytes = tarfile.REGTYPE, link: str = "", size: int = 10
) -> tarfile.TarInfo:
    info = tarfile.TarInfo(name)
    info.type, info.linkname = kind, link
    info.size = size if kind == tarfile.REGTYPE else 0
    return info


def _as_link(info: zipfile.ZipInfo) -> None:
    info.external_attr = (stat.S_IFLNK | 0o777) << 16


def _as_device(info: zipfile.ZipInfo) -> None:
    info.external_attr = (stat.S_IFCHR | 0o666) << 16


def archives() -> Iterator[Archive]:
    """Yield archives whose members leave their folder, are not files, or are too large or many."""
    data = b"x" * 100
    for about, name in {
        "dots": f"../{MARK}",
        "dots inside": f"a/../../{MARK}",
        "absolute": f"/tmp/{MARK}",
        "a drive": f"C:/{MARK}",
        "backslashes": f"..\\{MARK}",
        "an empty part": f"a//{MARK}",
        "a line break": f"a\n{MARK}",
        "escape": f"\x1b[2J{MARK}",
        "a long part": MARK + "a" * 250,
        "40 folders": "a/" * 40 + MARK,
    }.items():
        yield Archive(f"zip: {about}", "a.zip", _zip(("ok", data), (name, data)))
        yield Archive(f"tar: {about}", "a.tar", _tar(_member("ok"), _member(name)))
    yield Archive("zip: a folder of dots", "a.zip", _zip((f"../{MARK}/", b""), ("ok", data)))
    yield Archive("zip: NUL", "a.zip", _zip(("aaa", data), ("ok", data)).replace(b"aaa", b"a\0b"))
    yield Archive(
        "zip: one name twice", "a.zip", _zip(("ok", data), ("aa", data)).replace(b"aa", b"ok")
    )
    yield Archive("zip: names by case", "a.zip", _zip(("a.dcm", data), ("A.dcm", data)))
    yield Archive("zip: a file and a folder", "a.zip", _zip(("a", data), ("a/b", data)))
    yield Archive("zip: a link", "a.zip", _zip(("a", b"/etc/passwd"), change=_as_link))
    yield Archive("zip: a device", "a.zip", _zip(("a", data), change=_as_device))
    bomb = _zip(*((f"{k}", bytes(20_000_000)) for k in range(4)))
    yield Archive("zip: 80 MB of 0", "a.zip", bomb)
    lie = _zip(("a", bytes(70_000_000))).replace((70_000_000).to_bytes(4, "little"), b"\x64\0\0\0")
    yield Archive("zip: 70 MB that claims to be 100 bytes", "a.zip", lie)
    yield Archive("zip: many members", "a.zip", _zip(*((f"{k}", b"") for k in range(301))))
    whole = _zip(("a", bytes(range(256)) * 40))
    yield Archive("zip: cut off", "a.zip", whole[: len(whole) // 2])
    yield Archive(
        "zip: a byte changed", "a.zip", whole[:45] + bytes([whole[45] ^ 255]) + whole[46:]
    )
    yield Archive("zip: a mark alone", "a.zip", b"PK\x03\x04" + bytes(100))
    yield Archive("zip: with a password", "a.zip", _encrypted(whole))
    yield Archive("zip: an unknown packing", "a.zip", _packed_by(whole, 97))
    yield Archive("zip: nothing but folders", "a.zip", _zip(("a/", b"")), "archive: found no file")
    nested = _zip(("a.zip", whole), ("b.zip", whole))
    yield Archive("zip: zips in it", "a.zip", nested, "found 2 files of no known format")
    yield Archive(
        "zip: OME-Zarr with dots", "a.ozx", _zip(("zarr.json", data), (f"../{MARK}", data))
    )
    zeros = _zip(("zarr.json", data), *((f"c/{k}", bytes(20_000_000)) for k in range(4)))
    yield Archive("zip: OME-Zarr of 80 MB of 0", "a.ozx", zeros)
    for about, kind in {
        "a link": tarfile.SYMTYPE,
        "a hard link": tarfile.LNKTYPE,
        "a device": tarfile.CHRTYPE,
        "a block device": tarfile.BLKTYPE,
        "a pipe": tarfile.FIFOTYPE,
    }.items():
        yield Archive(
            f"tar: {about}", "a.tar", _tar(_member("ok"), _member("b", kind, "/etc/passwd"))
        )
    yield Archive("tar: one name twice", "a.tar", _tar(_member("a"), _member("a")))
    yield Archive("tar: names by case", "a.tar", _tar(_member("a"), _member("A")))
    yield Archive("tar: many members", "a.tar", _tar(*(_member(f"{k}") for k in range(301))))
    flood = _tar(_member("a", size=80_000_000), packing="w:gz")
    yield Archive("tar.gz: 80 MB of 0", "a.tar.gz", flood)
    cut = _tar(_member("a", size=5000), packing="w:gz")
    yield Archive("tar.gz: cut off", "a.tgz", cut[: len(cut) // 2])
    yield Archive("tar.gz: no tar in it", "a.tar.gz", gzip.compress(data))
    plain = _tar(_member("a", size=5000))
    yield Archive("tar: cut off", "a.tar", plain[:2000])


def _encrypted(content: bytes) -> bytes:
    """Return a zip file of one member whose flags say that it has a password."""
    changed = bytearray(content)
    changed[6] |= 1
    changed[content.index(b"PK\x01\x02") + 8] |= 1
    return bytes(changed)


def _packed_by(content: bytes, way: int) -> bytes:
    changed = bytearray(content)
    changed[8] = changed[content.index(b"PK\x01\x02") + 10] = way
    return bytes(changed)


REQUESTS = [
    *names(),
    *lists(),
    *addresses(),
    *pieces(),
    *bodies(),
    *paths(),
    *foreign(),
]

if __name__ == "__main__":
    kinds = Counter(one.name.partition(":")[0] for one in [*REQUESTS, *archives()])
    print("\n".join(f"{count:4d} {kind}" for kind, count in kinds.items()))
    print(f"{kinds.total():4d} in all")
