"""Each page of docs says what it is for and where to go next, is short, and is in plain English."""

import re
from pathlib import Path

import pytest
import yaml

from support import prose

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([*DOCS.glob("*.md"), *DOCS.glob("formats/*.md")])
DECISIONS = sorted(DOCS.glob("decisions/*.md"))
MAX_BYTES = 6000  # size of a page
MAX_AVERAGE_WORDS = 18.0  # words in a sentence of one page
MAX_PICTURE_BYTES = 60_000
# Pages whose tables a program or a test makes
GENERATED = {
    *("benchmarks.md", "edit-table.md", "input-formats.md", "keys.md", "licences.md", "systems.md"),
}
NAMES = [page.name for page in PAGES]


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_a_page_begins_with_what_it_is_for_and_ends_with_where_to_go_next(page: Path) -> None:
    text = page.read_text("utf-8")
    beginning = " ".join(text.split("## ")[0].split())
    assert re.search(r"\bThis page\b", beginning), "expected a sentence on what the page is for"
    last = text.strip().rpartition("\n\n")[2]
    assert "](" in last, "expected links to further pages at the end"


@pytest.mark.parametrize("page", PAGES, ids=NAMES)
def test_a_page_is_short(page: Path) -> None:
    if page.name not in GENERATED:
        assert page.stat().st_size <= MAX_BYTES


@pytest.mark.parametrize(
    "page",
    [*PAGES, *DECISIONS, ROOT / "README.md", ROOT / "CHANGELOG.md"],
    ids=lambda page: page.name,
)
def test_sentences_are_short_on_average(page: Path) -> None:
    found = [
        len(sentence.split())
        for _, text in prose.markdown(page.read_text("utf-8"))
        for sentence in prose.sentences(text)
    ]
    assert sum(found) <= MAX_AVERAGE_WORDS * len(found), sum(found) / len(found)


@pytest.mark.parametrize(
    "page",
    [*PAGES, *DECISIONS, ROOT / "README.md", ROOT / "CHANGELOG.md"],
    ids=lambda page: page.name,
)
def test_numbers_have_a_leading_zero(page: Path) -> None:
    code = r"(?ms)^ *```.*?^ *```|`[^`\n]*`|\]\([^)]*\)"
    text = re.sub(code, "", page.read_text("utf-8"))
    assert re.findall(r"(?<![\w.])\.\d+", text) == [], "write 0.8, not .8"


def test_pictures_are_small_and_used() -> None:
    shown = "".join(page.read_text("utf-8") for page in [*PAGES, ROOT / "README.md"])
    for picture in DOCS.rglob("*.webp"):
        assert picture.stat().st_size <= MAX_PICTURE_BYTES, picture.name
        assert f"{picture.name})" in shown, f"{picture.name}: no page shows it"


def test_every_page_is_in_the_navigation_of_the_site() -> None:
    text = (ROOT / "mkdocs.yml").read_text("utf-8")
    navigation = yaml.safe_load(text[text.index("nav:") :])["nav"]
    assert [next(iter(group)) for group in navigation] == ["Start", "Use", "Reference", "Inside"]
    named = set(re.findall(r"([\w/-]+\.md)$", text, re.MULTILINE))
    pages = {page.relative_to(DOCS).as_posix() for page in [*PAGES, *DECISIONS]}
    assert pages <= named
