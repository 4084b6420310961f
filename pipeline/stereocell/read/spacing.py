"""Voxel spacings and origins of levels, in um, from the metadata."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

from stereocell.model.errors import SourceError, UsageError
from stereocell.model.tiling import Box

Triple = tuple[float, float, float]
PartialTriple = tuple[float | None, float | None, float | None]

# um per unit, in the names of OME-Zarr (UDUNITS-2) and the symbols of OME-XML
_UM: dict[str, float] = {
    "angstrom": 1e-4,
    "\u00c5": 1e-4,
    "\u00e5": 1e-4,  # lower case of the letter above
    "\u212b": 1e-4,  # the angstrom sign, which is not the letter
    "\u00e5ngstrom": 1e-4,
    "\u00e5ngstr\u00f6m": 1e-4,
    "A": 1e-4,
    "picometer": 1e-6,
    "pm": 1e-6,
    "nanometer": 1e-3,
    "nm": 1e-3,
    "micrometer": 1.0,
    "micron": 1.0,
    "um": 1.0,
    "\u00b5m": 1.0,  # micro sign
    "\u03bcm": 1.0,  # Greek mu
    "\u00b5": 1.0,
    "\u03bc": 1.0,
    "\u00b5meter": 1.0,
    "\u03bcmeter": 1.0,
    "millimeter": 1e3,
    "mm": 1e3,
    "centimeter": 1e4,
    "cm": 1e4,
    "decimeter": 1e5,
    "dm": 1e5,
    "meter": 1e6,
    "m": 1e6,
    "inch": 25400.0,
    "in": 25400.0,
    "inche": 25400.0,  # `inches` without its s
}


@dataclass(frozen=True, slots=True)
class Level:
    """One resolution of a dataset; level 0 is the finest.

    shape       voxels (z, y, x)
    spacing_um  (z, y, x), um
    origin_um   centre of voxel (0, 0, 0), (z, y, x), um, from the same centre of level 0
    """

    shape: tuple[int, int, int]
    spacing_um: Triple
    origin_um: Triple = (0.0, 0.0, 0.0)

    @property
    def box(self) -> Box:
        """The box of the whole level."""
        return Box((0, 0, 0), self.shape)


@dataclass(frozen=True, slots=True)
class Grid:
    """The metadata of one level; None: not stated.

    shape       voxels (z, y, x)
    spacing_um  (z, y, x), um
    offset_um   centre of voxel (0, 0, 0), (z, y, x), um
    partial_um  (z, y, x), um, where the source states only some of them; `spacing_um` is then None
    hint        where the missing ones may be found, for the message; empty: not known
    """

    shape: tuple[int, int, int]
    spacing_um: Triple | None = None
    offset_um: Triple | None = None
    partial_um: PartialTriple = (None, None, None)
    hint: str = ""


def um_per(unit: object) -> float | None:
    """Return a unit of length in um; None: no unit, or not one of length (`pixel`).

    Units are recognised in any case, in the plural, in quotes or brackets, with either character
    for micro, and where UTF-8 was decoded as Latin-1.

    >>> um_per("[n_m]"), um_per(" Microns "), um_per("\u00c2\u00b5m")
    (0.001, 1.0, 1.0)
    """
    if not isinstance(unit, str):
        return None
    if (exact := _UM.get(unit)) is not None:
        return exact
    text = _from_latin_1(unit).strip(" \t\r\n\0\"'[]()")
    name = text.replace("_", "").lower().replace("metre", "meter")
    for form in (text, name, name.removesuffix("s")):
        if (found := _UM.get(form)) is not None:
            return found
    return None


def _from_latin_1(text: str) -> str:
    """Return the text of UTF-8 bytes that were decoded as Latin-1; other texts unchanged."""
    try:
        return text.encode("latin-1").decode("utf-8")
    except UnicodeError:
        return text


def levels_of(grids: tuple[Grid, ...], given_um: Triple | None, where: str) -> tuple[Level, ...]:
    """Return the levels, finest first.

    given_um  (z, y, x), um, the user's `--spacing-um`; replaces the metadata of level 0
    where     the source's name, for messages

    A coarser level without a translation counts as an average of blocks of voxels. So its first
    centre lies at 0.5 (f - 1) times level 0's spacing, where f is its factor. Raises SourceError
    where the spacing is missing or isn't a positive length, UsageError where `given_um` isn't one.
    """
    if given_um is not None:
        if len(given_um) != 3 or not all(_is_length(value) for value in given_um):
            text = ",".join(f"{value:g}" for value in given_um)
            raise UsageError(
                f"--spacing-um is {text}, expected z,y,x in um, each above 0, up to 1e9"
            )
        finest = given_um
        grids = tuple(grid if _is_sound(grid) else Grid(grid.shape) for grid in grids)
    elif grids[0].spacing_um is None:
        raise SourceError(f"{where}: voxel size: {_missing(grids[0])}")
    else:
        finest = grids[0].spacing_um
    _check(grids, where)

    levels = []
    for grid in grids:
        factors = _factors(grid, grids[0])
        spacing = _triple(s * f for s, f in zip(finest, factors, strict=True))
        origin = _triple(0.5 * (f - 1.0) * s for s, f in zip(finest, factors, strict=True))
        if grid.offset_um is not None and grids[0].offset_um is not None:
            # The stated offset is counted in stated spacings of level 0, so that a spacing that the
            # user gives scales the offset, too.
            stated = grids[0].spacing_um or finest
            shifts = zip(grid.offset_um, grids[0].offset_um, stated, finest, strict=True)
            origin = _triple((a - b) / own * used for a, b, own, used in shifts)
        levels.append(Level(grid.shape, spacing, origin))
    return tuple(levels)


def _check(grids: tuple[Grid, ...], where: str) -> None:
    for index, grid in enumerate(grids):
        for axis, value in zip("zyx", grid.spacing_um or (), strict=False):
            if not _is_length(value):
                raise SourceError(
                    f"{where}: voxel size {axis} of level {index}: found {value:g} um, "
                    "expected a length above 0, up to 1e+09 (or give --spacing-um z,y,x)"
                )
        for axis, value in zip("zyx", grid.offset_um or (), strict=False):
            if not math.isfinite(value):
                raise SourceError(
                    f"{where}: translation {axis} of level {index}: found {value:g} um, "
                    "expected a finite length"
                )
        if any(n < 1 for n in grid.shape):
            raise SourceError(
                f"{where}: shape (z, y, x) of level {index}: found {grid.shape}, "
                "expected at least one voxel along each axis"
            )
    for index, (finer, coarser) in enumerate(pairwise(grids), start=1):
        if any(b > a for a, b in zip(finer.shape, coarser.shape, strict=True)):
            raise SourceError(
                f"{where}: shape (z, y, x) of level {index}: found {coarser.shape}, "
                f"expected at most level {index - 1}'s {finer.shape}, since levels are listed "
                "from the finest to the coarsest"
            )


def _missing(grid: Grid) -> str:
    """Return the words for a spacing that is not stated, or only in part."""
    stated = zip("zyx", grid.partial_um, strict=True)
    found = [f"{axis} {value:.5g} um" for axis, value in stated if value is not None]
    if not found:
        hint = f" ({grid.hint})" if grid.hint else ""
        return (
            f"not found with a unit of length{hint}, "
            "expected it in the metadata, or give it with --spacing-um z,y,x"
        )
    lacking = [a for a, value in zip("zyx", grid.partial_um, strict=True) if value is None]
    form = ",".join(
        a if value is None else f"{value:.5g}"
        for a, value in zip("zyx", grid.partial_um, strict=True)
    )
    hint = f" ({grid.hint})" if grid.hint else ""
    return (
        f"found {', '.join(found)}, but none along {' and '.join(lacking)}{hint}, "
        f"expected all three, or give them with --spacing-um {form}"
    )


def grid_of(shape: tuple[int, int, int], stated_um: PartialTriple, hint: str = "") -> Grid:
    """Return a grid from a spacing (z, y, x), um, that is stated whole, in part or not at all."""
    z, y, x = stated_um
    if z is None or y is None or x is None:
        return Grid(shape, partial_um=stated_um, hint=hint)
    return Grid(shape, (z, y, x))


def _factors(grid: Grid, finest: Grid) -> Triple:
    """Return the number of level 0's voxels per voxel of this level, (z, y, x)."""
    if grid.spacing_um is not None and finest.spacing_um is not None:
        return _triple(a / b for a, b in zip(grid.spacing_um, finest.spacing_um, strict=True))
    return _triple(_shape_factor(n, m) for n, m in zip(finest.shape, grid.shape, strict=True))


def _shape_factor(fine: int, coarse: int) -> float:
    """Return the ratio of two sizes in voxels: whole where halving with rounding explains it."""
    whole = round(fine / coarse)
    if coarse in (fine // whole, -(-fine // whole)):
        return float(whole)
    return fine / coarse


def _is_sound(grid: Grid) -> bool:
    return grid.spacing_um is not None and all(_is_length(value) for value in grid.spacing_um)


def _is_length(value: float) -> bool:
    """Return whether a voxel can have this spacing, um. Other values are due to a wrong unit."""
    return 1e-6 <= value <= 1e9


def _triple(values: Iterable[float]) -> Triple:
    z, y, x = values
    return float(z), float(y), float(x)
