"""Make the bundles of the viewer's tests: `python -m support.viewer_bundles FOLDER [--deep]`.

One process makes them all, because each command would wait for the same imports and kernels. It
makes no reports. The bundle of `make demo` is not among them.
"""

import shutil
import sys
from pathlib import Path

from stereocell.cli.__main__ import main
from support import form_scenes
from support.exhaustive import IS_EXHAUSTIVE
from support.phantoms import write_f_everywhere
from support.stage_edits import write_layer, write_volume
from support.validators import make_assets

ALONE = ("--workers", "0")


def run(*arguments: Path | str) -> None:
    """Run a command. Ends the process if the command fails."""
    if code := main([str(one) for one in arguments]):
        sys.exit(code)


def make(source: Path, out: Path, grid: str, *plan: str) -> None:
    """Make a bundle. Ends the process if that fails."""
    if code := make_assets(source, out, grid, *ALONE, plan=plan):
        sys.exit(code)


def make_sample(name: str, file: Path, *flags: str) -> Path:
    """Write a sample into a file, unless the file exists, and return the file's path."""
    if not file.exists():
        run("sample", name, file, *flags)
    return file


def make_half(folder: Path) -> None:
    """Make a bundle of half of the demo's tiles."""
    file = make_sample("cycif", folder / "samples" / "half.ome.zarr", "--grid", "5x1")
    make(file, folder / "half", "5x1", "--preset", "cycif")
    run("check", folder / "half", *ALONE)


def make_brain_cells(folder: Path, *deep: str) -> None:
    """Make a bundle of real cells, with baked maps."""
    file = make_sample("brain-cells", folder / "samples" / "brain-cells.ome.tif")
    make(file, folder / "brain-cells", "2x2", "--preset", "lightsheet", "--maps")
    run("check", folder / "brain-cells", *deep, *ALONE)


def make_letters(folder: Path) -> None:
    """Make bundles of the same letter from each kind of source."""
    shutil.rmtree(folder, ignore_errors=True)
    write_f_everywhere(folder)
    for name in ("f.ome.tif", "f.ome.zarr", "f.nii.gz", "dicom"):
        make(folder / name, folder / f"of-{name}", "1x1")


def make_edited(folder: Path) -> None:
    """Make a bundle before and after an artist's edits of its stage."""
    shutil.rmtree(folder, ignore_errors=True)
    write_volume(folder)
    make(folder / "balls.ome.tif", folder / "built", "3x2")
    shutil.copytree(folder / "built" / "bundle", folder / "before")
    write_layer(folder / "my_edit.usda", Path("built/stage/stage.usda"))
    run("bundle", folder / "built", "--stage", folder / "my_edit.usda", *ALONE)


def make_forms(folder: Path) -> None:
    """Make bundles of one scene each of fluorescence, CT and MR."""
    shutil.rmtree(folder, ignore_errors=True)
    for name, file in form_scenes.write(folder / "sources").items():
        make(file, folder / name, "1x1", "--preset", form_scenes.PRESETS[name])


if __name__ == "__main__":
    place = Path(sys.argv[1])
    (place / "samples").mkdir(parents=True, exist_ok=True)
    if not IS_EXHAUSTIVE:  # the sweep opens the whole demo
        make_half(place)
    make_brain_cells(place, *sys.argv[2:])
    make_letters(place / "f")
    make_edited(place / "edit")
    make_forms(place / "forms")
