"""The head of one file of a folder of planes: what is known before its pixels are decoded."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from stereocell.read.spacing import PartialTriple
from stereocell.read.value_scale import ValueScale


@dataclass(frozen=True, slots=True)
class Head:
    """The metadata of a file.

    shape       rows, columns, samples (colour and alpha; 1: grey)
    pages       more than one: the file is a stack, or no plane
    spacing_um  (z, y, x), um, as far as it is stated
    z_um        where the plane lies along z, um; None: not stated
    z_field     the name of the field that states z_um
    has_z_unit  whether z_um is in a stated unit of length; else um are assumed
    yx_um       where the plane lies along y and x, um; None each: not stated
    values      how stored numbers become values
    is_inverse  the file states that 0 is white
    notes       on the pixels, for the user
    """

    shape: tuple[int, int, int]
    dtype: np.dtype[Any]
    pages: int = 1
    spacing_um: PartialTriple = (None, None, None)
    z_um: float | None = None
    z_field: str = "position along z"
    has_z_unit: bool = True
    yx_um: tuple[float | None, float | None] = (None, None)
    values: ValueScale = ValueScale()  # noqa: RUF009  (frozen)
    is_inverse: bool = False
    notes: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """Size and dtype, for messages."""
        rows, columns, samples = self.shape
        colour = f", {samples} samples a pixel" if samples > 1 else ""
        return f"{columns} x {rows} pixels of {self.dtype.name}{colour}"
