"""The place of a source: a local path or an address that fsspec opens."""

import os
import re
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import fsspec
from fsspec import AbstractFileSystem
from fsspec.asyn import AsyncFileSystem, sync
from fsspec.exceptions import FSTimeoutError

from stereocell.model.errors import SourceError, StereoCellError, UsageError
from stereocell.storage.archives import ARCHIVE_SUFFIXES, ZARR_FILES, archive_in, has_zarr
from stereocell.storage.first_bytes import HEAD_BYTES, identify

_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*://")  # a colon alone may be part of a file's name
_TIFF_SUFFIXES = (
    *(".ome.tiff", ".ome.tif", ".ome.tf2", ".ome.tf8", ".ome.btf"),
    *(".companion.ome", ".tiff", ".tif", ".tf2", ".tf8", ".btf", ".lsm", ".stk"),
)
_PLANE_SUFFIXES = (".tif", ".tiff", ".stk", ".lsm", ".png", ".jpg", ".jpeg", ".bmp")
_MAX_OTHERS = 200  # files without an image's name that are looked into for DICOM
_ZARR_SUFFIXES = (".ome.zarr", ".zarr")
_NIFTI_SUFFIXES = (".nii", ".nii.gz")
_DICOM_SUFFIXES = (".dcm", ".dicom", ".ima")
_ANALYZE_SUFFIXES = (".hdr", ".img", ".hdr.gz", ".img.gz")  # also pairs of NIfTI
# format -> endings of its files' names, in lower case
_FILE_SUFFIXES = {
    "tiff": _TIFF_SUFFIXES,
    "nifti": _NIFTI_SUFFIXES,
    "mgh": (".mgh", ".mgz", ".mgh.gz"),
    "ims": (".ims",),
    "hdf5": (".h5", ".hdf5", ".hdf", ".nc", ".nc4", ".mat", ".emd"),
    "nrrd": (".nrrd", ".nhdr"),
    "metaimage": (".mha", ".mhd"),
    "mrc": tuple(
        ending + packed
        for ending in (".mrc", ".rec", ".map", ".mrcs", ".ccp4")
        for packed in ("", ".gz", ".bz2")
    ),
    "czi": (".czi",),
    "lif": (".lif",),
    "nd2": (".nd2",),
}
# formats that are known by a file's first bytes, whatever its name (IMOD calls MRC .st, .ali, ...)
_BY_CONTENT = ("dicom", "tiff", "hdf5", "nrrd", "czi", "nd2", "lif", "mrc")
_KEYED = re.compile(r"(.*\.(?:h5|hdf5|hdf|nc|nc4|mat|emd)):(.*)", re.IGNORECASE | re.DOTALL)
ANSWER_S = 25.0  # below SILENCE_S, since fsspec's http turns a timeout into "does not exist"
_CONNECT_S, SILENCE_S = 15.0, 30.0  # limits of one request; s3fs repeats it
_AWS_CREDENTIALS = (
    "AWS_ACCESS_KEY_ID",
    "AWS_PROFILE",
    "AWS_WEB_IDENTITY_TOKEN_FILE",
    "AWS_CONTAINER_CREDENTIALS_RELATIVE_URI",
    "AWS_CONTAINER_CREDENTIALS_FULL_URI",
)


@dataclass(frozen=True, slots=True)
class Location:
    """One source.

    source    an absolute local path or an address, in the form of the format libraries; with
              `:/KEY` where it names a dataset in an HDF5 file
    is_local  a path on this machine
    """

    source: str
    is_local: bool

    @classmethod
    def of(cls, source: str | Path) -> "Location":
        """Return the location of a path or of an address such as `https://...` or `s3://...`.

        Raises UsageError for an invalid address, and for an empty name: it would be the folder in
        which the program runs.
        """
        text = str(source)
        if not text:
            raise UsageError("an empty name, expected a path or an address (. is this folder)")
        if not _ADDRESS.match(text):
            path, key = _split_key(text)
            return cls(os.path.abspath(os.path.expanduser(path)) + key, True)
        try:
            parts = urlsplit(text)
        except ValueError as error:
            raise UsageError(
                f"{text}: found no address ({error}), expected https:// or s3://"
            ) from None
        if parts.scheme == "file":
            return cls(os.path.abspath(unquote(parts.path)), True)
        return cls(text, False)

    @property
    def path(self) -> str:
        """The file or folder on this machine, without a dataset's key or a path in a zip file."""
        path = _split_key(self.source)[0]
        return archive_in(path) or path

    @property
    def key(self) -> str:
        """The dataset in an HDF5 file, as `/a/b`; empty where none is named."""
        return _split_key(self.source)[1][1:]

    @property
    def folder(self) -> Path:
        """The source's own folder, links followed: its files must lie there or below."""
        path = Path(os.path.realpath(self.path))
        return path if path.is_dir() else path.parent

    @property
    def shown(self) -> str:
        """The source without secrets of an address (user, password, signature)."""
        if self.is_local:
            return self.source
        parts = urlsplit(self.source)
        host = parts.netloc.rpartition("@")[2]
        return f"{parts.scheme}://{host}{parts.path}"

    @property
    def parts(self) -> tuple[str, ...]:
        """The names along the path."""
        path = _split_key(self.source)[0] if self.is_local else self.shown.partition("://")[2]
        return tuple(part for part in path.split("/") if part)

    @property
    def name(self) -> str:
        """The file's name without its suffix, for display; `plate.zarr/0` becomes `plate-0`."""
        parts = self.parts
        whole = (".zarr", ".n5", *ARCHIVE_SUFFIXES)
        outermost = (i for i, part in enumerate(parts) if part.endswith(whole))
        first = next(outermost, len(parts) - 1)
        return "-".join(_stem(part) for part in parts[first:]) or "dataset"

    @property
    def format(self) -> str | None:
        """The name of the format (readers.READERS); None: neither name nor content fits one.

        Planes are a folder of images without DICOM; DICOM is any other folder on this machine, and
        a file with DICOM's first bytes.
        """
        if any(part.endswith(".zarr") for part in self.parts):
            return "ome-zarr"
        if self.is_zarr_archive:
            return "ome-zarr"
        if any(part.endswith(".n5") for part in self.parts) or self._is_n5():
            return "n5"
        if self.is_local and any(os.path.exists(f"{self.source}/{file}") for file in ZARR_FILES):
            return "ome-zarr"
        if self.is_local and _holds_planes(self.source):
            return "planes"
        if not self.parts:
            return None
        last = self.parts[-1].lower()
        for name, endings in _FILE_SUFFIXES.items():
            if last.endswith(endings):
                return name
        return self._format_by_content(last) if self.is_local else None

    def _format_by_content(self, last: str) -> str | None:
        """Return the format of a file whose name leaves it open; `last` is the name, lower case."""
        found = identify(first_bytes(self.path)).format
        if found in _BY_CONTENT:
            return found
        if last.endswith(_DICOM_SUFFIXES) or os.path.isdir(self.source):
            return "dicom"
        if last.endswith(_ANALYZE_SUFFIXES):
            return "nifti"
        return "bdv" if self._is_bdv() else None

    @property
    def is_zarr_archive(self) -> bool:
        """Whether a source is a zip file of OME-Zarr or a group in one; at an address by name."""
        if not self.is_local:
            return bool(self.parts) and self.parts[-1].lower().endswith(ARCHIVE_SUFFIXES)
        path = archive_in(self.source)
        return bool(path) and has_zarr(path)

    def _is_bdv(self) -> bool:
        """Whether a file is the XML of BigDataViewer."""
        is_named = self.source.lower().endswith(".xml")
        return is_named and b"<SpimData" in first_bytes(self.source, count=1 << 16)

    def _is_n5(self) -> bool:
        """Whether a folder is a group or a dataset of N5: others have no `attributes.json`."""
        return self.is_local and os.path.exists(f"{self.source}/attributes.json")

    @property
    def storage_options(self) -> dict[str, Any]:
        """The options of fsspec for this address.

        s3: signed requests where this machine's environment holds credentials or `FSSPEC_S3`
        requests it, else anonymous ones, which public buckets accept. The endpoint comes from the
        usual environment (`AWS_ENDPOINT_URL`); timeouts of `FSSPEC_S3` take precedence.
        http: a timeout for silence only; else aiohttp stops any transfer after 5 minutes.
        """
        scheme = urlsplit(self.source).scheme
        if scheme in ("http", "https"):
            return {"client_kwargs": _http_client()}
        if scheme not in ("s3", "s3a"):
            return {}
        configured = fsspec.config.conf.get("s3", {})
        waits = {"connect_timeout": _CONNECT_S, "read_timeout": SILENCE_S}
        options = {"config_kwargs": {**waits, **configured.get("config_kwargs", {})}}
        if "anon" in configured:
            return {**options, "anon": configured["anon"]}
        files = (
            os.environ.get("AWS_SHARED_CREDENTIALS_FILE", "~/.aws/credentials"),
            os.environ.get("AWS_CONFIG_FILE", "~/.aws/config"),
        )
        signed = any(name in os.environ for name in _AWS_CREDENTIALS) or any(
            os.path.exists(os.path.expanduser(file)) for file in files
        )
        return {**options, "anon": not signed}


def _http_client() -> dict[str, Any]:
    """Return aiohttp's settings: ours, overridden by the user's for fsspec."""
    from aiohttp import ClientTimeout  # slow to import, and only the network needs it

    waits = ClientTimeout(total=None, sock_connect=SILENCE_S, sock_read=SILENCE_S)
    configured: dict[str, Any] = {}
    for protocol in ("http", "https"):  # fsspec has one file system for both
        configured |= fsspec.config.conf.get(protocol, {}).get("client_kwargs", {})
    return {"timeout": waits, **configured}


def does_answer(files: AbstractFileSystem, path: str) -> bool:
    """Return whether a store answers within ANSWER_S; an error is an answer, too.

    Each request is repeated, with its own timeout: without this limit, a silent host that accepts
    connections would block for minutes.
    """
    if isinstance(files, AsyncFileSystem):
        try:
            sync(files.loop, files._exists, path, timeout=ANSWER_S)
        except FSTimeoutError:
            return False
        except Exception:  # the reader reports it, better
            pass
    return True


def is_own(path: str | Path, folders: Sequence[Path]) -> bool:
    """Return whether a path, its links followed, lies in one of some folders or below."""
    real = Path(os.path.realpath(path))
    return any(real.is_relative_to(folder) for folder in folders)


def require_own(
    path: str | Path,
    folders: Sequence[Path],
    *,
    named: str,
    raised: type[StereoCellError] = SourceError,
) -> os.stat_result | None:
    """Return the state of a file that a source refers to, or None where there is none.

    Sources come from strangers, and results are published. So every file that a source refers to,
    by a path in its metadata or by a link, must be a regular file in one of `folders` (links
    followed) or below. Else `raised` is raised, with `named` and the reason, and the file is not
    opened (a pipe would block).
    """
    real = os.path.realpath(path)
    if not is_own(real, folders):
        raise raised(
            f"{named}: leads to {real}, expected a file in {folders[0]} or below (links followed)"
        )
    try:
        status = os.stat(real)
    except OSError:  # the reader reports it
        return None
    if not stat.S_ISREG(status.st_mode):
        raise raised(f"{named}: is no regular file, expected one")
    return status


def require_own_key(key: str, named: str) -> None:
    """Raise SourceError where a key leaves the address that it is joined to.

    Stores of http accept `%2e%2e` for `..`, escaped any number of times.
    """
    found, steps = "", key
    while found != steps:
        found, steps = steps, unquote(steps)
    if ".." in re.split(r"[/\\?#]", steps):
        raise SourceError(f"{named}: leads out of the address, expected a key below it")


def require_apart(source: str | Path, out: Path) -> None:
    """Raise UsageError if OUT is a local source, or lies inside one (or inside its .zarr)."""
    location = Location.of(source)
    if not location.is_local:
        return
    path = Path(location.source)
    outermost = next((p for p in [*reversed(path.parents), path] if p.suffix == ".zarr"), path)
    # not Path.resolve, which raises its own error for a ring of links
    if Path(os.path.realpath(out)).is_relative_to(os.path.realpath(outermost)):
        raise UsageError(
            f"OUT is {out}, inside the input {outermost}, expected a folder elsewhere: "
            "it would write into the data"
        )


def _holds_planes(folder: str) -> bool:
    """Return whether a folder holds images of planes, and no DICOM beside them."""
    are_there, others = False, 0
    for at, folders, names in os.walk(folder):
        folders.sort()
        for name in sorted(names):
            lower = name.lower()
            if lower.startswith("."):
                continue
            if lower.endswith(_PLANE_SUFFIXES):
                are_there = True
            elif lower.endswith(_DICOM_SUFFIXES):
                return False
            elif others < _MAX_OTHERS:
                others += 1
                if first_bytes(os.path.join(at, name))[128:132] == b"DICM":
                    return False
    return are_there


def require_file(location: Location) -> None:
    """Raise SourceError where a local source is a folder and its format's name says a file."""
    if location.is_local and os.path.isdir(location.path):
        raise SourceError(f"{location.shown}: is a folder, expected a file")


def _split_key(text: str) -> tuple[str, str]:
    """Return a path and the `:/KEY` behind it; a file whose own name holds that goes first."""
    found = _KEYED.fullmatch(text)
    if found is None or os.path.exists(text):
        return text, ""
    return found[1], f":/{found[2].lstrip('/')}"


def first_bytes(path: str, *, count: int = HEAD_BYTES) -> bytes:
    """Return the head of a regular file; nothing where it can't be read."""
    if not os.path.isfile(path):
        return b""
    try:
        with open(path, "rb") as file:
            return file.read(count)
    except OSError:
        return b""


def _stem(name: str) -> str:
    files = (ending for endings in _FILE_SUFFIXES.values() for ending in endings)
    endings = (*_ZARR_SUFFIXES, *ARCHIVE_SUFFIXES, ".zip", ".n5", ".xml", *files)
    for suffix in sorted(endings, key=len, reverse=True):
        if name.lower().endswith(suffix) and len(name) > len(suffix):
            return name[: -len(suffix)]
    return name
