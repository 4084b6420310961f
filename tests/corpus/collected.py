"""Small public volumes on which no constant was chosen; their truths come from other methods.

They lie in the folder `level_corpus` of STEREOCELL_DATA. Each is an NPZ file with `voxels`
(z, y, x), `truth` (bool; an empty array if it is unknown) and `spacing_um`. The files are made by
collect.py, which documents their sources and truths.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus.case import Case, Group, Kind, Mask

# Name, source, kind, group, and the level of the surface that the truth belongs to (0 is the outer)
_TABLE: tuple[tuple[str, str, Kind, Group, int], ...] = (
    ("ct_trunk", "TotalSegmentator", "CT", "outlined", 0),
    ("ct_trunk_bone", "TotalSegmentator", "CT", "labelled", 1),
    ("ct_chest", "TotalSegmentator", "CT", "outlined", 0),
    ("mr_trunk", "TotalSegmentator", "MR", "outlined", 0),
    ("mra_aorta", "VMTK", "MR", "labelled", 0),
    ("monkey_brain", "NiiVue", "MR", "labelled", 0),
    ("mr_t1", "NiiVue images", "MR", "outlined", 0),
    ("mr_pd", "NiiVue images", "MR", "outlined", 0),
    ("iguana_body", "NiiVue images", "microscopy", "outlined", 0),
    ("iguana_bone", "NiiVue images", "microscopy", "outlined", 1),
    ("cta_head", "NiiVue images", "microscopy", "looked at", 0),
    ("mra_head", "NiiVue images", "MR", "looked at", 0),
    ("mr_gd_thick", "PyRadiomics", "MR", "outlined", 0),
    ("mr_teaching", "NEUBIAS", "MR", "outlined", 0),
    ("nuclei_teaching", "NEUBIAS", "microscopy", "outlined", 0),
    ("chromosomes", "NEUBIAS", "microscopy", "outlined", 0),
    ("nucleus", "NEUBIAS", "microscopy", "outlined", 0),
    ("mitotic_plate", "NEUBIAS", "microscopy", "outlined", 0),
    ("dna_confocal", "NEUBIAS", "microscopy", "outlined", 0),
    ("golgi", "NEUBIAS", "microscopy", "outlined", 0),
    ("dna_widefield", "NEUBIAS", "microscopy", "looked at", 0),
    ("nuclear_envelopes", "NEUBIAS", "microscopy", "looked at", 0),
    ("nuclei_cleared_brain", "CellSeg3D", "microscopy", "outlined", 0),
    ("ct_stent", "imageio", "microscopy", "outlined", 0),
)


def collected_cases(folder: Path) -> Iterator[Case]:
    """Yield the volumes that the folder has. `missing` lists the other names."""
    for name, source, kind, group, level in _TABLE:
        path = folder / f"{name}.npz"
        if not path.is_file():
            continue
        with np.load(path) as file:
            z, y, x = (float(side) for side in file["spacing_um"])
        yield Case(
            name.replace("_", " "),
            group,
            (z, y, x),
            partial(_load, path),
            kind=kind,
            held_out=True,
            level=level,
            source=source,
        )


def missing(folder: Path) -> list[str]:
    """Return the names of the volumes that the folder lacks."""
    return [name for name, *_ in _TABLE if not (folder / f"{name}.npz").is_file()]


def _load(path: Path) -> tuple[NDArray[Any], Mask | None]:
    with np.load(path) as file:
        voxels, truth = file["voxels"], file["truth"]
    return voxels, truth if truth.size else None
