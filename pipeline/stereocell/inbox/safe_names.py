"""Names of ours for the files of one specimen, in place of those that people gave them.

Names of files may hold the name of a person. Readers need some of what names say: the ending, the
numbers of planes and channels, the keys of a Zarr group. That much is kept.
"""

import re
from collections.abc import Sequence

from stereocell.inbox.names import Parts, without_shared_folders
from stereocell.read.formats.ome_zarr.archive import ZARR_FILES
from stereocell.read.formats.planes.names import COUNTERS
from stereocell.read.known_formats import known_formats

NAME = "specimen"
_IMAGES = re.compile(r".*\.(tiff?|png|jpe?g|bmp)", re.IGNORECASE)
_OTHER_ENDING = re.compile(r"\.[A-Za-z0-9]{1,8}$")
_TOKENS = re.compile(r"[A-Za-z]+|[0-9]+|[^A-Za-z0-9]+")
_GROUP_ENDINGS = (".ome.zarr", ".zarr", ".n5")


def ending_of(name: str) -> str:
    """Return the ending of a name, as `.nii.gz`: of a known format, or a short one of any kind."""
    lower = name.lower()
    known = sorted(
        {
            ending
            for one in known_formats().values()
            for ending in (*one.endings, *one.loose_endings)
            if lower.endswith(ending)
        },
        key=len,
    )
    if known:
        return known[-1]
    found = _OTHER_ENDING.search(name)
    return found[0].lower() if found else ""


def group_names(names: Sequence[Parts]) -> list[Parts] | None:
    """Return names for the files of a Zarr or N5 group; None: they are none.

    The keys in the group stay; the folder of the group gets a name of ours.
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
    """Return names without the folders around the group, but with those inside it."""
    tops = [parts[:-1] for parts in names if parts[-1] in own]
    depth = min(map(len, tops))
    if len({top[:depth] for top in tops}) == 1 and all(
        parts[:depth] == tops[0][:depth] for parts in names
    ):
        return [parts[depth:] for parts in names]
    return without_shared_folders(names)


def are_planes(names: Sequence[Parts]) -> bool:
    """Return whether all files are images of planes that no file lists by their names."""
    return all(_IMAGES.fullmatch(parts[-1]) and ".ome." not in parts[-1].lower() for parts in names)


def plane_names(names: Sequence[Parts]) -> list[Parts]:
    """Return names for planes: numbers and words that tell files apart stay, other words go.

    >>> plane_names([("Doe_z01.tif",), ("Doe_z02.tif",)])
    [('x_z01.tif',), ('x_z02.tif',)]
    """
    split = [_TOKENS.findall("/".join(parts)) for parts in without_shared_folders(names)]
    forms = {tuple(_kind(token) for token in tokens) for tokens in split}
    if len(forms) != 1:  # in no common order: their own order is all that is known
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
    if token.isalpha() and token.isascii() and token.lower() not in COUNTERS:
        return ["x"] * len(tokens)
    if token.isdecimal():
        return ["0"] * len(tokens)
    kept = "".join(c if c in "/._- " else "_" for c in token) if not token.isalnum() else token
    return [kept] * len(tokens)


def _kind(token: str) -> str:
    return "n" if token[0].isdecimal() else "a" if token[0].isalnum() and token.isascii() else token
