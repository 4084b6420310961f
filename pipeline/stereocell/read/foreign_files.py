"""Formats that are not read, recognised by file name, each with a way to a format that is read.

Most unsupported formats are recognised by their first bytes (storage/first_bytes.py). The formats
here share their first bytes with others, or have no fixed ones.
"""

from dataclasses import dataclass
from pathlib import Path

from stereocell.storage.first_bytes import BIOFORMATS

_AS_CSV = "save it as CSV UTF-8"
_HEADER = (
    "write a header of MetaImage beside it, NAME.mhd, with the lines NDims = 3, DimSize = X Y Z, "
    "ElementSpacing = X Y Z (mm), ElementType = MET_USHORT, ElementDataFile = {name}"
)


@dataclass(frozen=True, slots=True)
class Foreign:
    """A format that is not read.

    endings  endings of file names, in lower case
    title    name of the format, with an article
    remedy   how to convert the file to a format that is read
    is_other whether its files begin like those of a format that is read, but hold something else
    """

    endings: tuple[str, ...]
    title: str
    remedy: str
    is_other: bool = False


FOREIGN = (
    Foreign((".oib", ".oif"), "an image of Olympus FluoView", BIOFORMATS),
    Foreign((".vsi",), "an overview of Olympus VSI, whose voxels are in the folder beside it",
            BIOFORMATS, is_other=True),
    Foreign((".zvi",), "an image of Zeiss AxioVision", BIOFORMATS),
    Foreign((".sld", ".sldy"), "an image of SlideBook", BIOFORMATS),
    Foreign((".dv", ".r3d"), "an image of DeltaVision", BIOFORMATS),
    Foreign((".ids",), "the voxels of an ICS image", BIOFORMATS),
    Foreign((".spe",), "an image of Princeton Instruments", BIOFORMATS),
    Foreign((".mnc",), "a MINC file", "mnc2nii makes NIfTI of it", is_other=True),
    Foreign((".mat",), "a MATLAB file before 7.3", "save it in MATLAB with -v7.3"),
    Foreign((".vti",), "a VTK file", "ParaView saves it as Meta Image (.mhd)"),
    Foreign((".xlsx", ".xls", ".ods", ".numbers"), "a workbook of a spreadsheet", _AS_CSV),
    Foreign((".rds", ".rdata", ".sav", ".feather", ".jmp"), "a table of a statistics program",
            _AS_CSV),
    Foreign((".pt", ".pth", ".ckpt"), "a file of PyTorch",
            "tifffile.imwrite makes a TIFF of its array"),
)  # fmt: skip
_PHILIPS = "dcm2niix makes NIfTI of the pair"
_VOXELS = (".raw", ".vol", ".bin", ".dat")
# endings of the headers that VGStudio and PyHST write beside a file of voxels
_SIDECARS = (".vgi", ".info", ".vol.info", ".raw.info")


def foreign_words(path: str, *, only_other: bool = False) -> str:
    """Return what a file is by its name, with a remedy; empty: the ending is not known.

    only_other  count only formats whose files begin like those of a format that is read
    """
    lower = path.lower()
    if lower.endswith(".rec") and (header := _par_beside(Path(path))):
        return f"the voxels of a Philips PAR/REC pair, beside {header!r:.100} ({_PHILIPS})"
    for one in FOREIGN:
        if lower.endswith(one.endings) and (one.is_other or not only_other):
            return f"{one.title} ({one.remedy})"
    return ""


def _par_beside(path: Path) -> str:
    """Return the name of the Philips header beside a .rec file; empty: there is none."""
    names = (path.with_suffix(suffix).name for suffix in (".PAR", ".par"))
    return next((name for name in names if path.with_name(name).is_file()), "")


def bare_voxels_words(path: Path) -> str:
    """Return a description of a raw voxel file and the remedy; empty: it has another ending."""
    if path.suffix.lower() not in _VOXELS:
        return ""
    names = [path.name + ending for ending in _SIDECARS]
    names += [path.with_suffix(ending).name for ending in _SIDECARS]
    beside = next((name for name in names if path.with_name(name).is_file()), "")
    described = f", described by {beside!r:.100}" if beside else ", if it is a volume"
    return f"voxels without a header{described} ({_HEADER.format(name=path.name)})"
