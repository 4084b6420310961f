"""Compare the colours of a first view and of the built bundle by CIEDE2000 of the means.

    .venv/bin/python tests/bench/live_color.py [SOURCE ...]

For each source, the command writes the first view and builds the bundle. Both are drawn with their
opening view, with a focus disc and without one. The mean covers all pixels except background. The
sources are those of live_view.py.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from live_view import SOURCES
from machine import stated
from numpy.typing import NDArray
from PIL import Image
from skimage.color import deltaE_ciede2000, rgb2lab

from stereocell.live.fine_tiles import FineTiles
from stereocell.live.first_view import read_channels, write_first_view
from stereocell.planning.input_files import as_asked
from stereocell.planning.preset_choice import load_for
from stereocell.planning.settle import settle
from stereocell.steps.open_source import open_source

BOUND = 8.0  # CIEDE2000; above it the built specimen would look like another one
MODES = ("disc", "stage")  # the mode with which a page opens, and surfaces alone
VIEWER = Path(__file__).parents[2] / "viewer_gltf"
_PAST = 12  # difference from the background, 0..255, above which a pixel counts
_CANVAS = (slice(70, 600), slice(0, 960))  # rows and columns of a picture without panel and marks


def main(words: list[str]) -> None:
    given = {word: [str(Path(word).resolve())] for word in words} or {
        name: flags for name, flags in SOURCES.items() if Path(flags[0].split(":")[0]).exists()
    }
    print(f"{'':12} dE {MODES[0]:>7} dE {MODES[1]:>7}   mean colours, first view and built")
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        for name, flags in given.items():
            root, out = Path(folder) / "view", Path(folder) / "out"
            write_view_of(flags, root)
            command = [sys.executable, "-m", "stereocell.cli", "build", *flags, "-o", str(out)]
            subprocess.run(command, check=True, capture_output=True)
            found, colors = [], []
            for mode in MODES:
                first, built = (mean_color(one, mode) for one in (root, out / "bundle"))
                found.append(difference(first, built))
                colors.append(f"{first.round()} {built.round()}")
            print(f"{name[-12:]:12} {found[0]:10.1f} {found[1]:10.1f}   {'  '.join(colors)}")
            sys.stdout.flush()
            worst = max(worst, *found)
            subprocess.run(["rm", "-r", str(root), str(out)], check=True)
    print(f"largest {worst:.1f}, bound {BOUND:g}")


def write_view_of(flags: list[str], root: Path) -> None:
    """Write the first view of a source into a folder."""
    source, plan_flags = flags[0], {}
    if "--spacing-um" in flags:
        words = flags[flags.index("--spacing-um") + 1].split(",")
        plan_flags["spacing_um"] = tuple(float(word) for word in words)
    settings, choice = load_for(source, None, None, flags={"plan": plan_flags})
    plan = settle(source, settings, choice)
    dataset = open_source(as_asked(plan.source, plan.settings.plan))
    sizes = FineTiles(plan, dataset).sizes()
    write_first_view(plan, read_channels(plan, dataset), root, sizes)


def mean_color(bundle: Path, mode: str) -> NDArray[np.float64]:
    """Return the mean sRGB, 0 to 255, of the specimen's pixels in a picture of a bundle."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.png"
        command = ["npx", "tsx", "scripts/screenshot.ts", str(bundle), str(picture), "--mode", mode]
        subprocess.run(command, cwd=VIEWER, check=True, capture_output=True)
        pixels = np.asarray(Image.open(picture).convert("RGB"), np.float64)[_CANVAS]
    background = pixels[0, 0]
    specimen = pixels[np.abs(pixels - background).max(axis=-1) > _PAST]
    return np.asarray(specimen.mean(axis=0))


def difference(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    return float(deltaE_ciede2000(rgb2lab(first / 255), rgb2lab(second / 255)))


if __name__ == "__main__":
    with stated():
        main(sys.argv[1:])
