"""The report: its curves, remarks and sums, and the page as a whole."""

import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from markupsafe import escape

from stereocell.building.out_folder import OutFolder
from stereocell.building.surface_cover import SurfaceCover
from stereocell.cli.__main__ import main
from stereocell.engine.run import Engine
from stereocell.model.channel import SurfaceLevel
from stereocell.model.errors import OutputError
from stereocell.model.tiling import Box, Tile
from stereocell.model.unit import Cover
from stereocell.planning.channels import Channel
from stereocell.report import charts, page, pictures
from stereocell.report.facts import LodFacts, StepFacts, UnitFacts, gather, sum_up
from stereocell.report.opening import find_opening
from stereocell.report.page import write_report
from stereocell.report.remarks import find_covers, find_remarks
from stereocell.steps.unit_files import is_whole
from support import phantoms

NASTY = 'F <b> & "body"'


# --- curves


def test_chart_marks_the_surface_s_iso_value_and_the_others() -> None:
    svg = charts.candidates([0.0, 1.0, 0.0], taken=[0.75], others=[0.25, 2.0])
    assert svg.count('class="mark" d="M240.0,') == 1
    assert 'class="found" d="M80.0,' in svg
    assert 'class="found" d="M320.0,' in svg  # beyond the axis: at its end
    assert "mark" not in charts.candidates([0.0, 1.0], taken=[], others=[0.5])


def test_histogram_draws_every_transfer_function() -> None:
    svg = charts.histogram([5] * 256, {"default": ((0.0, 0.0), (1.0, 0.5))}, None)
    assert 'class="tf tf-default" d="M0.0,120.0L320.0,62.0"' in svg
    assert "mark" not in svg


# --- remarks and sums


def _unit(**changed: object) -> UnitFacts:
    values = {
        "tile": Tile("r0_c0", Box((0, 0, 0), (2, 2, 2))),
        "channel": Channel(0, "CD31", (1.0, 0.0, 0.0)),
        "directory": Path("unit"),
        "iso_value": 100.0,
        "background": 0.0,
        "confidence": 0.5,
        "reason": "",
        "lods": (LodFacts(10, 0.1, 1000), LodFacts(5, 0.3, 400)),
        "voxels": (4, 4, 4),
        "volume_bytes": 64,
        "ktx2_bytes": 30,
        "fragments_dropped": 0,
        "cavities_filled": 0,
        "cover": None,
        "seconds": {"read": 1.0},
    }
    return UnitFacts(**{**values, **changed})  # type: ignore[arg-type]


def test_sums_add_triangles_and_keep_the_largest_distance() -> None:
    total = sum_up([_unit(), _unit(lods=(LodFacts(1, 0.7, 10),)), _unit(lods=())])
    assert total.lods == (LodFacts(11, 0.7, 1010), LodFacts(5, 0.3, 400))
    assert (total.units, total.voxels, total.volume_bytes, total.ktx2_bytes) == (3, 192, 192, 90)


# --- the page


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An F (its iso-value given), the same left to the criterion, and an empty channel; 2 tiles."""
    folder = tmp_path_factory.mktemp("report")
    body = phantoms.f_phantom()
    voxels = np.stack([body, body + np.uint16(7), np.full_like(body, 300)])
    source = phantoms.write_ome_tiff(
        folder / "<i>f.ome.tif", voxels, axes="CZYX", names=[NASTY, "twin", "empty"]
    )
    out = folder / "out"
    arguments = ["--grid", "2x1", "--iso-value", f"{NASTY}=500"]
    assert main(["plan", str(source), "-o", str(out), *arguments]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    return out


class _Page(HTMLParser):
    """Tags, attributes and text of a page."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.alts: list[str] = []
        self.texts: list[str] = []
        self.tags: list[str] = []
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name in ("src", "href"):
                self.addresses.append(value or "")
            if name == "alt":
                self.alts.append(value or "")

    def handle_data(self, data: str) -> None:
        self.texts.append(" ".join(data.split()))


def _write(out: Path, *, texture_similarity: bool = False) -> tuple[str, _Page]:
    write_report(out, Engine(0), texture_similarity=texture_similarity)
    html = OutFolder(out).report_file.read_text("utf-8")
    return html, _Page(html)


@pytest.fixture(scope="module")
def written(built: Path) -> tuple[str, _Page]:
    """The page of the build, as text and as parsed HTML."""
    return _write(built)


@pytest.mark.slow
def test_page_holds_its_pictures(written: tuple[str, _Page]) -> None:
    html, parsed = written
    inside = [a for a in parsed.addresses if a.startswith(("data:image/webp;base64,", "#"))]
    assert inside == parsed.addresses
    assert "url(" not in html
    assert "@import" not in html
    drawn = [alt for alt in parsed.alts if alt.startswith(("Surfaces", "All surfaces"))]
    assert drawn == ["All surfaces of <i>f", "Surfaces of tile r0_c0", "Surfaces of tile r0_c1"]


@pytest.mark.slow
def test_page_has_slices_and_levels_of_each_unit(written: tuple[str, _Page]) -> None:
    html, parsed = written
    for channel in (NASTY, "twin", "empty"):
        for tile in ("r0_c0", "r0_c1"):
            assert f"Slices of {channel} in tile {tile}" in parsed.alts
    assert "at 500" in parsed.texts
    assert "given" in parsed.texts
    assert "the same in all tiles" in parsed.texts
    assert "1 channel without a surface" in parsed.texts
    nothing = "empty: no clear surface: nothing stands out: no iso-value has more than a few voxels"
    assert any(text.startswith(nothing) for text in parsed.texts)
    assert any(text.startswith("--iso-value twin=") for text in parsed.texts)  # if it is wrong
    assert any(alt.startswith("Contour of twin at ") for alt in parsed.alts)
    assert "there is no bundle yet" in html


@pytest.mark.slow
def test_page_gives_the_reason_where_a_channel_has_no_2d_function(
    built: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    shutil.copytree(built, out)

    survey = OutFolder(out).survey()
    proposals = [entry["statistics"]["suggested"] for entry in survey.values()]
    triangle = {
        "kind": "triangle",
        "values": [0.0, 1.0],
        "gradients": [0.2, 1.0],
        "tip": 0.45,
        "color": [1.0, 1.0, 1.0],
        "opacity": 0.7,
        "softness": 0.5,
    }
    proposals[0]["reason"], proposals[1]["reason"] = "too <dim>", ""
    proposals[0]["transfer_2d"]["functions"] = {}
    proposals[1]["transfer_2d"]["functions"] = {"arcs": [triangle] * 2}
    OutFolder(out).save_survey(survey)
    _, parsed = _write(out)
    assert [b for a, b in pairwise(parsed.texts) if a == "2D function"] == [
        "none: too <dim>",
        "2 boundaries between materials",
        # one value is one material, and a boundary takes two
        "none: materials found: 1, expected at least 2",
    ]


@pytest.fixture(scope="module")
def compared(built: Path) -> tuple[str, _Page]:
    """The page of the same build with the similarity of levels."""
    return _write(built, texture_similarity=True)


def _without_seal(html: str) -> tuple[str, str]:
    """Return a page without its last line, a hash of the others, and this line."""
    text, seal = html.rstrip("\n").rsplit("\n", 1)
    return text + "\n", seal


def test_levels_are_compared_only_if_asked_for(
    written: tuple[str, _Page], compared: tuple[str, _Page]
) -> None:
    (text, _), (without, _) = (_without_seal(html) for html in (compared[0], written[0]))
    assert "front, 512 px" in compared[1].texts
    end = "</tbody></table></div>\n"
    start = text.index('<p class="note">Similarity: ')
    assert text[:start] + text[text.index(end, start) + len(end) :] == without
    assert "SSIM" not in without


@pytest.mark.slow
def test_flag_of_the_command_adds_the_comparison_and_its_absence_removes_it(
    built: Path, tmp_path: Path
) -> None:
    shutil.copytree(built, out := tmp_path / "out")
    for flags in ([], ["--texture-similarity"], []):
        assert main(["report", *flags, str(out), "--workers", "0"]) == 0
        html = OutFolder(out).report_file.read_text("utf-8")
        assert ("Similarity: " in html) == bool(flags)


def test_notes_on_distances_name_attributes_of_the_stage(
    compared: tuple[str, _Page],
) -> None:
    """Each note names both distances, since the page shows one and viewers use the other."""
    text, _ = compared
    notes = re.findall(r'<p class="note">(.*?)</p>', text, re.DOTALL)
    for start in ("Distance: ", "Similarity: "):
        [note] = [note for note in notes if note.startswith(start)]
        for word in ("stereocell:distance", "p99_um", "stereocell:largestDistance", "largest_um"):
            assert word in note
        assert "geometricError" in note


def test_names_of_data_are_text_and_never_markup(written: tuple[str, _Page]) -> None:
    html, parsed = written
    assert "<i>f" not in html
    assert "F <b>" not in html
    assert "script" not in parsed.tags
    assert NASTY in parsed.texts


@pytest.mark.exhaustive
def test_same_results_give_the_same_page(built: Path) -> None:
    assert _write(built)[0] == _write(built)[0]


@pytest.mark.slow
def test_page_of_many_units_shows_some_and_says_how_many(
    built: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pictures, "MAX_PICTURED", 4)
    monkeypatch.setattr(page, "MAX_ROWS", 5)
    html, parsed = _write(built)
    shown = sum(alt.startswith("Slices") for alt in parsed.alts)
    assert 0 < shown <= 4
    assert f"{shown} of 6 pairs of a tile and a channel have pictures here, evenly chosen" in html
    assert "(5 of 6 pairs, evenly chosen)" in html


def test_report_before_units_names_the_command(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="run `stereocell plan"):
        write_report(tmp_path, Engine(0))
    assert not (tmp_path / "report").exists()


def test_channels_without_a_clear_surface_have_remarks(built: Path) -> None:
    facts = gather(OutFolder(built))
    assert [step.name for step in facts.steps][:2] == ["read", "distance"]
    assert all(isinstance(step, StepFacts) for step in facts.steps)
    units = (
        _unit(),
        _unit(reason="no voxel crosses the iso-value"),
        _unit(reason="dark", channel=Channel(2, "dim", (0.0, 0.0, 1.0))),
        _unit(fragments_dropped=1200, cavities_filled=3),
    )
    channels = (units[0].channel, units[2].channel)
    looks = {
        name: replace(
            facts.survey["empty"].appearance,
            surface=confidence,
            surface_reason=reason,
            level=level,
        )
        for name, confidence, reason, level in (
            ("CD31", "unsure", "unsure surface: it is noisy", SurfaceLevel(100.0, None, 1.0)),
            ("dim", "none", "no clear surface: nothing stands out", None),
        )
    }
    survey = {name: replace(facts.survey["empty"], appearance=look) for name, look in looks.items()}
    plan = replace(facts.plan, channels=channels, notes=())
    titles = {
        r.title: r.lines
        for r in find_remarks(replace(facts, units=units, survey=survey, plan=plan))
    }
    assert titles == {
        "1 channel without a surface": ("dim: no clear surface: nothing stands out",),
        "1 channel with an unsure surface": ("CD31: unsure surface: it is noisy",),
        "1 pair of tile and channel without a surface, though the channel has one in other tiles": (
            "r0_c0/CD31: no voxel crosses the iso-value",
        ),
        "1,200 fragments removed": ("CD31: 1,200 in 1 tile, most in r0_c0 (1,200)",),
        "3 cavities filled": ("CD31: 3 in 1 tile, most in r0_c0 (3)",),
    }


def test_opening_says_what_was_built_how_sure_it_is_and_where_to_look(built: Path) -> None:
    facts = gather(OutFolder(built))
    opening = find_opening(facts, find_covers(facts.units), (), ["twin"])
    name = facts.plan.name
    assert opening.built == (
        f"StereoCell built volumes of 3 channels and surfaces of 2 of them from {name}, in 2 tiles."
    )
    assert opening.certainty.startswith("The surface of twin is clear: its confidence is 0.")
    assert opening.look_first == "Look first at empty, which has no surface."
    assert opening.anchor == "channels"


def test_opening_names_unsure_surfaces_and_leads_to_other_iso_values(built: Path) -> None:
    facts = gather(OutFolder(built))
    twin = facts.survey["twin"]
    unsure = replace(twin, appearance=replace(twin.appearance, surface="unsure"))
    facts = replace(facts, survey={**facts.survey, "twin": unsure})
    opening = find_opening(facts, find_covers(facts.units), (), ["twin"])
    assert opening.certainty == "1 of 1 surface is unsure: twin."
    assert opening.look_first == (
        "Look first at the other iso-values of twin, which may fit better."
    )
    assert opening.anchor == "wrong"


def test_opening_leads_to_a_surface_that_leaves_out_voxels(built: Path) -> None:
    facts = gather(OutFolder(built))
    covers = {"twin": SurfaceCover(Cover(1000, 600, 700), 0)}
    opening = find_opening(facts, covers, (), ["twin"])
    assert opening.look_first == (
        "Look first at the slices of twin, whose surface leaves out 40% of the voxels above its "
        "iso-value."
    )
    assert opening.anchor == "tiles"


def test_thin_triangles_at_the_finest_level_have_a_note(built: Path) -> None:
    angles = (13.0, 11.0, 9.5)
    units = tuple(
        _unit(
            tile=Tile(f"r0_c{i}", Box((0, 0, 0), (2, 2, 2))),
            lods=(LodFacts(10, 0.1, 1000, angle_deg=angle), LodFacts(5, 0.3, 40, angle_deg=1.0)),
        )
        for i, angle in enumerate(angles)
    )
    facts = gather(OutFolder(built))
    named = Channel(0, "CD31", (1.0, 0.0, 0.0))
    survey = {"CD31": next(iter(facts.survey.values()))}
    facts = replace(facts, plan=replace(facts.plan, channels=(named,), notes=()), survey=survey)
    (remark,) = find_remarks(replace(facts, units=units))
    assert remark.is_note
    assert remark.title.startswith("1 channel with thin triangles at the finest level")
    assert remark.lines == ("CD31: 9.5° in r0_c2; 2 tiles have such triangles",)
    assert not find_remarks(replace(facts, units=units[:1]))


def test_each_unit_s_slowest_step_is_named(built: Path, written: tuple[str, _Page]) -> None:
    text, _ = written
    units = gather(OutFolder(built)).units
    assert units
    for unit in units:
        step = max(unit.seconds, key=lambda name: unit.seconds[name])
        assert re.search(rf"{re.escape(escape(unit.name))}.*{escape(step)}</td>", text), unit.name


@pytest.mark.slow
def test_report_is_written_where_times_are_missing(built: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    shutil.copytree(built, out)
    for file in (out / "units").rglob("seconds.json"):
        file.unlink()
    _write(out)
    facts = gather(OutFolder(out))
    assert facts.steps == ()
    assert all(is_whole(unit.directory) for unit in facts.units)


def test_totals_take_the_worst_distance_and_angle_and_add_up_faults() -> None:
    one = LodFacts(10, 0.1, 100, 0.02, 0.05, 0.4, 0, 2, 9.0, 0.6)
    other = LodFacts(5, 0.3, 40, 0.01, 0.2, 0.3, 1, 0, 4.0, 0.9)
    total = sum_up([_unit(lods=(one,)), _unit(lods=(other,))])
    assert total.lods == (LodFacts(15, 0.3, 140, 0.02, 0.2, 0.4, 1, 2, 4.0, 0.6),)


@pytest.mark.slow
def test_iso_values_outside_the_window_are_named_without_a_contour(
    tmp_path: Path,
) -> None:
    """The body lies in the first of three tiles, and the window ends far below its level."""
    z, y, x = np.mgrid[:24, :24, :96]
    body = (z - 12) ** 2 + (y - 12) ** 2 + (x - 14) ** 2 < 80
    rng = np.random.default_rng(0)
    voxels = (100 + 900 * body + rng.normal(0, 8, body.shape)).astype(np.uint16)
    source = phantoms.write_ome_tiff(tmp_path / "b.ome.tif", voxels[None], "CZYX", names=["b"])
    out = tmp_path / "out"
    flags = ["--grid", "3x1", "--iso-value", "b=300", "--window", "b=0:200"]
    assert main(["plan", str(source), "-o", str(out), *flags]) == 0
    assert main(["units", str(out), "--workers", "0"]) == 0
    html, _ = _write(out)
    levels = html[html.index("What to do if this is wrong") : html.index('id="tiles"')]
    assert "tile r0_c0" in levels
    assert "tile r0_c1" not in levels
    assert "outside the display window of 0 to 200, so its contour" in levels
