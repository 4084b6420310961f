"""Compare the adaptive threshold with Otsu's and Li's on the head phantom: values, shares, Dice.

There are two truths: the whole head, and the brain's grey and white matter. Air is dark, bone
nearly as dark, and fluid darker than tissue. A threshold's value decides which truth it can match.
A second table states how the adaptive threshold reads each histogram: its peaks, and those that it
ignores as chance. With --images FOLDER, it also reads your own images, in the preset's window and
in full range.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from machine import stated

import stereocell.read
from stereocell.model.tiling import Box
from stereocell.report.thresholds import describe, find_peers
from stereocell.samples.head import BACKGROUND, GREY, WHITE, make_head
from stereocell.transfer.channel_statistics import find_statistics
from stereocell.transfer.options import WindowOptions
from support.iso_value_family import dice

WINDOW = WindowOptions(1.0, 99.8)  # window of the preset mri


def main(images: str | None) -> None:
    readings = []
    print("| noise | threshold | value | voxels above | Dice, head | Dice, grey and white |")
    print("|---|---|---|---|---|---|")
    for noise in (0.0, 0.01, 0.02, 0.05, 0.09):
        head = make_head(noise=noise, bias=0.2)
        statistics = find_statistics(head.voxels.copy(), WINDOW)
        found = statistics.threshold
        assert found is not None
        readings.append((f"{noise:.0%}", found))
        otsu, li = find_peers(statistics.values)
        body, matter = head.labels != BACKGROUND, np.isin(head.labels, (GREY, WHITE))
        for name, value in (("adaptive", found.value), ("Otsu", otsu), ("Li", li)):
            above = head.voxels >= value
            print(
                f"| {noise:.0%} | {name} | {value:.0f} | {above.mean():.1%} | "
                f"{dice(above, body):.3f} | {dice(above, matter):.3f} |"
            )
    if images is not None:
        dataset = stereocell.read.open(images)
        voxels = dataset.read(0, Box((0, 0, 0), dataset.levels[0].shape), 0).voxels
        for name, window in (("images", WINDOW), ("full range", WindowOptions(0.0, 100.0))):
            found = find_statistics(voxels.copy(), window).threshold
            if found is not None:
                readings.append((name, found))
    print("\n| of | adaptive | how it was read |\n|---|---|---|")
    for name, found in readings:
        print(f"| {name} | {found.value:.4g} | {describe(found)} |")


if __name__ == "__main__":
    with stated():
        main(sys.argv[2] if sys.argv[1:2] == ["--images"] else None)
