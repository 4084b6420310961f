"""Write volumes with spacing, origin, direction and channel names: .nrrd, .nii, .nii.gz, .raw."""

import json
from pathlib import Path

import numpy as np

from stereocell.export.chosen import Chosen
from stereocell.export.options import ExportOptions
from stereocell.export.voxels import Layout, fill, find_layout, map_file
from stereocell.formats.nrrd_write import nrrd_head
from stereocell.model.errors import UsageError

_UNITY_MOST = 2048  # voxels, largest size of Unity's 3D textures along an axis
_NIFTI_MOST = 32767  # voxels, largest size along an axis, which NIfTI stores in 16 bits
_NIFTI_UNITS = {"um": "micron", "mm": "mm", "m": "meter"}
_COMMENT = 6  # NIfTI's code for an extension that holds text
_LPS_TO_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


def write_nrrd(chosen: Chosen, path: Path, _: int) -> str:
    """Write .nrrd; return a sentence about its voxels."""
    layout = _layout(chosen)
    head = nrrd_head(layout.grid, layout.dtype, layout.names)
    path.write_bytes(head)
    fill(layout, chosen, map_file(path, layout, len(head)))
    return layout.about


def write_raw(chosen: Chosen, path: Path, _: int) -> str:
    """Write .raw, which has only voxels, and a header file: .nhdr, or Unity's .raw.ini.

    Returns a sentence about the voxels.
    """
    layout = _layout(chosen)
    path.touch()
    fill(layout, chosen, map_file(path, layout, 0))
    x, y, z = layout.grid.size
    beside = described_by(path, chosen.options)
    if chosen.options.unity:
        lines = [f"dimx:{x}", f"dimy:{y}", f"dimz:{z}", "skip:0", f"format:{layout.dtype.name}"]
        beside.write_bytes("\n".join([*lines, "endianness:LittleEndian", ""]).encode("ascii"))
        across = ", ".join(
            f"{n * s:.6g}" for n, s in zip((x, y, z), layout.grid.spacing, strict=True)
        )
        return f"{layout.about}; {beside.name} describes it; {across} {layout.grid.unit} across"
    beside.write_bytes(nrrd_head(layout.grid, layout.dtype, layout.names, data_file=path.name))
    return f"{layout.about}; {beside.name} describes it"


def described_by(path: Path, options: ExportOptions) -> Path:
    """Return the path of the header file that describes a .raw."""
    return path.with_name(f"{path.name}.ini") if options.unity else path.with_suffix(".nhdr")


def write_nifti(chosen: Chosen, path: Path, _: int) -> str:
    """Write .nii or .nii.gz, with channels along the fourth axis; return a sentence about it."""
    layout = _layout(chosen)
    grid = layout.grid
    if max(grid.size) > _NIFTI_MOST:
        raise UsageError(
            f"{path.name}: found {max(grid.size)} voxels along an axis, expected at most "
            f"{_NIFTI_MOST}: use .nrrd"
        )
    scratch = path.with_name("voxels")
    scratch.touch()
    values = map_file(scratch, layout, 0)
    fill(layout, chosen, values)
    voxels = values.transpose(3, 2, 1, 0)
    voxels = voxels if len(layout.channels) > 1 else voxels[..., 0]
    affine = _LPS_TO_RAS @ grid.affine
    import nibabel  # slow to import

    image = nibabel.Nifti1Image(voxels, affine, dtype=layout.dtype)  # type: ignore[no-untyped-call]
    code = "scanner" if grid.is_patient else "aligned"
    image.set_sform(affine, code)  # type: ignore[no-untyped-call]
    image.set_qform(affine, code)  # type: ignore[no-untyped-call]
    image.header.set_xyzt_units(_NIFTI_UNITS[grid.unit])  # type: ignore[no-untyped-call]
    image.header["descrip"] = ", ".join(layout.names).encode()[:79]
    text = json.dumps({"channels": layout.names}).encode()
    image.header.extensions.append(nibabel.nifti1.Nifti1Extension(_COMMENT, text))
    image.to_filename(path)
    del values, voxels, image
    scratch.unlink()
    return layout.about


def _layout(chosen: Chosen) -> Layout:
    layout = find_layout(chosen)
    if chosen.options.unity and max(layout.grid.size) > _UNITY_MOST:
        raise UsageError(
            f"--unity: found {max(layout.grid.size)} voxels along an axis, expected at most "
            f"{_UNITY_MOST}: choose a --region"
        )
    return layout
