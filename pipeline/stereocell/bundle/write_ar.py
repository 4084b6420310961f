"""Write the bundle's specimen.usdz for augmented reality. On iOS, the page has a link to it.

The bundle does not copy the stage's specimen.usdz but writes another one from the composed stage,
which includes an artist's edits. A phone loads the whole file before it shows anything. So a file
above MAX_USDZ_BYTES is left out, and the manifest gives the reason.
"""

from pathlib import Path
from typing import Any

from stereocell.storage.file_list import measure
from stereocell.usd.write_usdz import write_usdz
from stereocell.usd.written_files import USDZ_NAME, AsWritten

MAX_USDZ_BYTES = 20 * 2**20  # bytes, largest specimen.usdz
NO_SURFACE = "no surface is drawn"


def write_ar(
    stage_path: Path, root: Path, as_written: AsWritten
) -> tuple[dict[str, Any] | None, str]:
    """Write specimen.usdz of a stage, or of a layer over it, into `root`.

    Returns its path, size and hash with an empty text, or None with the reason why there is none.
    Raises StageError if a file of the stage can't be read or is damaged, and OutputError if the
    file can't be written.
    """
    path = root / USDZ_NAME
    if write_usdz(stage_path, path, as_written=as_written) is None:
        return None, NO_SURFACE
    entry = {"path": USDZ_NAME, **measure(path)}
    if entry["bytes"] <= MAX_USDZ_BYTES:
        return entry, ""
    path.unlink()  # the bundle is not on object storage yet, so deleting the local file is enough
    return None, (
        f"it would have {entry['bytes'] / 2**20:.0f} MiB, above the limit of "
        f"{MAX_USDZ_BYTES / 2**20:.0f} MiB for phones"
    )
