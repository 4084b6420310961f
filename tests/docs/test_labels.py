"""Labels that the pages about the viewer name in italics are labels of the viewer."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
VIEWER_PAGES = (
    "viewer", "look-around", "channels", "value-and-gradient", "path-tracing", "cutting",
    "measure", "viewer-objects", "stereo", "stereo-screen", "save-share", "phone",
)  # fmt: skip
SOURCES = "\n".join(
    file.read_text("utf-8")
    for file in sorted((ROOT / "viewer_gltf" / "src").rglob("*.ts"))
    if not file.name.endswith(".test.ts")
)
# Words in italics that are not labels, or labels that are put together from parts
NO_LABELS = {"Kept for offline: the overview and 3 of 10 tiles", "2D"}


@pytest.mark.parametrize("name", VIEWER_PAGES)
def test_a_label_in_italics_is_in_the_viewer(name: str) -> None:
    text = re.sub(r"(?ms)^```.*?^```", "", (DOCS / f"{name}.md").read_text("utf-8"))
    labels = re.findall(r"(?<![*\w])\*([^*\n]+)\*(?![*\w])", text)
    for label in set(labels) - NO_LABELS:
        assert re.search(rf"[\"'`>]{re.escape(label)}", SOURCES), f"{name}.md: *{label}*"
