"""Draw the images of docs/choosing.md and docs/looks-wrong.md: `make docs-pictures`.

    python docs/iso_value_pictures.py SAMPLE FOLDER

SAMPLE is the volume of `stereocell sample cycif`. Builds of a part of it go into FOLDER, and images
of their surfaces into docs/pictures. One build has the iso-value that a build finds, one a lower
value, one a higher value, and one a wrong voxel spacing.
"""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from PIL import Image

from stereocell.cli.__main__ import main as run

PICTURES = Path(__file__).parent / "pictures"
QUALITY = 75  # quality of WebP, 0 to 100
MAX_SIZE = (900, 1100)  # pixels; larger images of contours are scaled down
PART = ("--preset", "cycif", "--channels", "Hoechst", "--region", "0:48,0:96,0:192")
BUILDS: Mapping[str, Sequence[str]] = {
    "iso-value-right": (),
    "iso-value-low": ("--iso-value", "Hoechst=230"),
    "iso-value-high": ("--iso-value", "Hoechst=1900"),
    "spacing-wrong": ("--spacing-um", "0.07,0.14,0.14"),  # the true spacing along z is 0.28 um
}
CONTOURS = ("--channel", "CD31", "--tile", "r1_c2", "--preset", "cycif", "--grid", "5x2")


def draw(sample: Path, folder: Path) -> None:
    """Build each variant of the part, and write its image."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, flags in BUILDS.items():
        out, drawn = folder / name, folder / f"{name}.png"
        _run("build", sample, "-o", out, *PART, *flags)
        _run("export", out, drawn, "--width", 480)
        _store(drawn, name)
    _run("iso", sample, *CONTOURS, "-o", folder / "iso.png")
    _store(folder / "iso.png", "iso")


def _run(*words: object) -> None:
    if code := run([str(word) for word in words]):
        sys.exit(code)


def _store(drawn: Path, name: str) -> None:
    image = Image.open(drawn).convert("RGB")
    image.thumbnail(MAX_SIZE)
    image.save(PICTURES / f"{name}.webp", quality=QUALITY, method=6)


if __name__ == "__main__":
    draw(Path(sys.argv[1]), Path(sys.argv[2]))
