"""The bundle's specimen.usdz, for viewers of augmented reality: the page links it on iOS.

It is made anew from the composed stage, so that it shows an artist's edits. A phone loads it whole
before it shows anything: a file above MAX_USDZ_BYTES is left out, and the manifest says why.
"""

from pathlib import Path
from typing import Any

from stereocell.storage.file_list import measure
from stereocell.usd.write_usdz import USDZ_NAME, write_usdz
from stereocell.usd.written_files import AsWritten

MAX_USDZ_BYTES = 20 * 2**20
NO_SURFACE = "no surface is drawn"


def write_ar(
    stage_path: Path, root: Path, as_written: AsWritten
) -> tuple[dict[str, Any] | None, str]:
    """Write specimen.usdz of a stage, or of a layer over it, into `root`.

    Returns its path, size and hash, and ""; or None, and why there is none. Raises StageError where
    the stage can't be read or a file of it is damaged, OutputError where the file can't be written.
    """
    path = root / USDZ_NAME
    if write_usdz(stage_path, path, as_written=as_written) is None:
        return None, NO_SURFACE
    entry = {"path": USDZ_NAME, **measure(path)}
    if entry["bytes"] <= MAX_USDZ_BYTES:
        return entry, ""
    path.unlink()  # of a folder that is stored once it is whole
    return None, (
        f"{entry['bytes'] / 2**20:.0f} MiB, more than the {MAX_USDZ_BYTES / 2**20:.0f} MiB "
        "that a phone is sent"
    )
