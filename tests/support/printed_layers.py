"""The USD layers that README.md and docs/ print, to be used as a reader would use them."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]


def find_layers() -> dict[str, str]:
    """Return each printed layer by its page and line; every block of `usda` is a layer."""
    found = {}
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))):
        text = page.read_text("utf-8")
        for block in re.finditer(r"^ *```usda\n(.*?)^ *```", text, re.DOTALL | re.MULTILINE):
            line = text.count("\n", 0, block.start()) + 2
            found[f"{page.relative_to(ROOT)}:{line}"] = block[1]
    return found


def write_layer(layer: str, path: Path, stage: Path, channel: str) -> Path:
    """Write a printed layer over another stage, with that stage's channel."""
    assert "@out/mine/stage/stage.usda@" in layer
    named = layer.replace("out/mine/stage/stage.usda", str(stage)).replace("CD31", channel)
    path.write_text(named)
    return path
