"""What a folder that was named as one source holds of other formats: hints for messages."""

from collections import Counter
from pathlib import Path

from stereocell.storage.location import Location

_LOOKED_AT = 1000  # entries of a folder
_TITLES = {
    "ome-zarr": "OME-Zarr",
    "tiff": "TIFF",
    "dicom": "DICOM",
    "nifti": "NIfTI or Analyze",
    "ims": "Imaris",
    "hdf5": "HDF5",
    "bdv": "XML of BigDataViewer",
    "metaimage": "MetaImage",
}  # others by their name in capitals


def others_in(folder: str | Path, *known: str) -> str:
    """Return what a folder holds of other formats than the known ones, as `2 HDF5, 1 MRC`.

    Names of files may be private, and stay out. Empty: nothing, or it is no folder.
    """
    root = Path(folder)
    paths = sorted(root.iterdir())[:_LOOKED_AT] if root.is_dir() else []
    formats = Counter(Location.of(path).format for path in paths)
    kinds = sorted(kind for kind in formats if kind and kind not in known)
    return ", ".join(f"{formats[kind]} {_TITLES.get(kind, kind.upper())}" for kind in kinds)


def or_one_of(folder: str | Path, *known: str) -> str:
    """Return the end of a refusal: what else could be meant. Empty where there is nothing."""
    held = others_in(folder, *known)
    return f", or one of the folder's other files, by its own name ({held})" if held else ""
