"""Read the b-values of a NIfTI's images from the `.bval` file beside it, as FSL and BIDS use.

References: https://bids-specification.readthedocs.io (diffusion imaging data)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from stereocell.read.diffusion import diffusion_note, order_of
from stereocell.storage.location import Location, is_own

_MAX_BYTES = 1 << 20
_PLACE = "the .bval file beside it"  # without the file's name, which may identify the patient


@dataclass(frozen=True, slots=True)
class ImageOrder:
    """The order of the images in a file.

    order  stored index of the image at each time point
    notes  a sentence on the b-values
    files  files that were read
    """

    order: Sequence[int]
    notes: tuple[str, ...] = ()
    files: tuple[str, ...] = ()


def image_order(location: Location, count: int) -> ImageOrder:
    """Return the order of `count` images; images of b 0 come first if the b-values are stated."""
    stored = range(count)
    stem = location.path.removesuffix(".gz").removesuffix(".nii")
    path = Path(f"{stem}.bval")
    is_named = count > 1 and stem != location.path.removesuffix(".gz")
    if not is_named or not path.is_file() or not is_own(path, [location.folder]):
        return ImageOrder(stored)
    if path.stat().st_size > _MAX_BYTES:
        return ImageOrder(stored)
    try:
        values = [float(part) for part in path.read_text("ascii", "replace").split()]
    except ValueError:
        return ImageOrder(stored, (f"{_PLACE}: found text that is not a number: it is not used",))
    if len(values) != count or not np.isfinite(values).all():
        found = f"found {len(values)} b-values, expected {count}, one for each image"
        return ImageOrder(stored, (f"{_PLACE}: {found}: it is not used",))
    return ImageOrder(order_of(values), (diffusion_note(values, _PLACE),), (str(path),))
