"""Neutral names for the files of one specimen, in place of the names that people gave them.

The name of a file may contain the name of a person. The new name keeps only the parts that readers
need: the ending, the numbers of planes and channels, and the keys of a Zarr group.
"""

import re
from collections.abc import Sequence
from functools import cache

from stereocell.inbox.names import Parts, without_shared_folders
from stereocell.read.foreign_files import FOREIGN
from stereocell.read.formats.ome_zarr.archive import ZARR_FILES
from stereocell.read.formats.planes.names import COUNTERS
from stereocell.read.known_formats import known_formats

NAME = "specimen"
_IMAGE_ENDINGS = (".ome.tif", ".ome.tiff", ".tif", ".tiff", ".png", ".jpg", ".jpeg", ".bmp")
_VOXELS = (".raw", ".zraw", ".img", ".vol", ".bin", ".dat")  # data files that a header names
_TOKENS = re.compile(r"[^\W\d_]+|[0-9]+|[/._ -]+|.")
_GROUP_ENDINGS = (".ome.zarr", ".zarr", ".n5")


def ending_of(name: str) -> str:
    """Return the ending of a name, such as `.nii.gz`, if a format has it; else an empty text.

    An unknown ending is dropped, since it could be part of a person's name.
    """
    lower = name.lower()
    return max((one for one in _endings() if lower.endswith(one)), key=len, default="")


@cache
def _endings() -> frozenset[str]:
    rows = known_formats().values()
    known = {one for row in rows for one in (*row.endings, *row.packed_endings, *row.loose_endings)}
    return frozenset(known.union(_IMAGE_ENDINGS, _VOXELS, *(one.endings for one in FOREIGN)))


def group_names(names: Sequence[Parts]) -> list[Parts] | None:
    """Return new names for the files of a Zarr or N5 group; None if the files form no group.

    The keys inside the group stay; the group's folder gets a neutral name.
    """
    own = (*ZARR_FILES, "attributes.json")
    if not any(parts[-1] in own for parts in names):
        return None
    shared = names[0][:-1] if len({parts[0] for parts in names}) == 1 else ()
    is_n5 = not any(parts[-1] in ZARR_FILES for parts in names)
    given = next((part.lower() for part in shared if part.lower().endswith(_GROUP_ENDINGS)), "")
    ending = next((one for one in _GROUP_ENDINGS if given.endswith(one)), "")
    root = f"{NAME}{ending or ('.n5' if is_n5 else '.ome.zarr')}"
    return [(root, *parts) for parts in _below_group(names, own)]


def _below_group(names: Sequence[Parts], own: Sequence[str]) -> list[Parts]:
    """Return the files' names relative to the folder of the Zarr or N5 group."""
    tops = [parts[:-1] for parts in names if parts[-1] in own]
    depth = min(map(len, tops))
    if len({top[:depth] for top in tops}) == 1 and all(
        parts[:depth] == tops[0][:depth] for parts in names
    ):
        return [parts[depth:] for parts in names]
    return without_shared_folders(names)


def are_planes(names: Sequence[Parts]) -> bool:
    """Return whether all files are images of planes. OME-TIFF lists its files, and is excluded."""
    return all(
        parts[-1].lower().endswith(_IMAGE_ENDINGS) and ".ome." not in parts[-1].lower()
        for parts in names
    )


def plane_names(names: Sequence[Parts]) -> list[Parts]:
    """Return new names for planes: parts that distinguish the files stay, other words are dropped.

    >>> plane_names([("Doe_z01.tif",), ("Doe_z02.tif",)])
    [('x_z01.tif',), ('x_z02.tif',)]
    """
    split = [_TOKENS.findall("/".join(parts)) for parts in without_shared_folders(names)]
    forms = {tuple(_kind(token) for token in tokens) for tokens in split}
    if len(forms) != 1:  # the names share no pattern, so only their order is kept
        return [(f"{index:06d}{ending_of(parts[-1])}",) for index, parts in enumerate(names)]
    columns = [
        _safe_column(column, i, len(split[0])) for i, column in enumerate(zip(*split, strict=True))
    ]
    return [tuple("".join(tokens).split("/")) for tokens in zip(*columns, strict=True)]


def _safe_column(tokens: Sequence[str], index: int, count: int) -> Sequence[str]:
    is_ending = index == count - 1
    if len(set(tokens)) > 1 or is_ending:
        return tokens
    token = tokens[0]
    if token.isalpha():
        kept = token if token.lower() in COUNTERS else "x"
    elif token.isdecimal():
        kept = "0"
    else:
        kept = token if token[0] in "/._ -" else "_"
    return [kept] * len(tokens)


def _kind(token: str) -> str:
    return "number" if token.isdecimal() else "word" if token.isalpha() else token
