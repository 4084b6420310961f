"""The head of one file in a folder of planes: what is known before its pixels are decoded."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from stereocell.read.spacing import PartialTriple
from stereocell.read.value_scale import ValueScale


@dataclass(frozen=True, slots=True)
class Head:
    """The metadata of a file.

    shape       rows, columns, samples (colour and alpha; 1: grey)
    pages       number of pages; more than one: the file is a stack, not a plane
    spacing_um  (z, y, x), um, as far as it is stated
    z_um        position of the plane along z, um; None: not stated
    z_field     name of the field that states z_um
    has_z_unit  whether z_um has a stated unit of length; otherwise um are assumed
    yx_um       position of the plane along y and x, um; None for each one not stated
    values      rule by which stored numbers become values
    is_inverse  whether the file states that 0 is white
    notes       notes on the pixels, for the user
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
