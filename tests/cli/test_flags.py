"""The flags of settings: declared beside them, offered by each command that takes an input."""

import argparse
from dataclasses import fields, make_dataclass
from typing import Any

import pytest

from stereocell.cli import flags
from stereocell.cli.__main__ import _parser
from stereocell.model.errors import UsageError
from stereocell.model.settings import Flag, setting
from stereocell.planning.settings import Settings, apply

# words that a person types, and the setting that they have to become
TYPED: dict[str, tuple[list[str], str, str, Any]] = {
    "--level": (["2"], "plan", "level", 2),
    "--channels": (["CD31, 2"], "plan", "channels", ("CD31", "2")),
    "--region": (["0:1,2:3,4:5"], "plan", "region", "0:1,2:3,4:5"),
    "--tile-size": (["8,9,10"], "plan", "tile_size", (8, 9, 10)),
    "--grid": (["5x2"], "plan", "grid", "5x2"),
    "--time": (["3"], "plan", "time", 3),
    "--series": (["4"], "plan", "series", 4),
    "--pattern": (["a_c{c}_z{z}.tif"], "plan", "pattern", "a_c{c}_z{z}.tif"),
    "--axes": (["zcyx"], "plan", "axes", "zcyx"),
    "--spacing-um": (["2,.5,.5"], "plan", "spacing_um", (2.0, 0.5, 0.5)),
    "--as": (["intensity"], "plan", "taken_as", "intensity"),
    "--dark": ([], "plan", "dark", True),
    "--modality": (["PT"], "plan", "modality", "PT"),
    "--keep-holder": ([], "surface", "keep_holder", True),
    "--neurological": ([], "plan", "neurological", True),
    "--iso-criterion": (["adaptive"], "isovalue", "criterion", "adaptive"),
    "--wrap": (["alpha-wrap"], "surface", "wrap", "alpha-wrap"),
    "--caps": ([], "surface", "caps", True),
    "--closed-tiles": ([], "surface", "closed_tiles", True),
    "--iso-value": (["a=b=400"], "iso_values", "a=b", 400.0),
    "--window": (["CT=-160:240"], "windows", "CT", "-160:240"),
    "--bits": (["8"], "volume", "bits", 8),
    "--without-vdb": ([], "volume", "without_vdb", True),
    "--surfaces": (["CT=outer,300"], "surfaces", "CT", "outer,300"),
    "--iso-scope": (["tile"], "isovalue", "scope", "tile"),
    "--paint": (["CD31=MART1"], "paint", "CD31", "MART1"),
    "--maps": ([], "unwrap", "maps", True),
    "--labels": (["cells=a=b.tif"], "labels", "cells", "a=b.tif"),
    "--background": (["65535"], "objects", "background", 65535),
    "--table": (["t.csv"], "objects", "table", "t.csv"),
    "--table-key": (["id"], "objects", "table_key", "id"),
    "--columns": (["CD8, type"], "objects", "columns", ("CD8", "type")),
    "--segment-labels": ([], "objects", "segment_labels", True),
    "--color-by": (["CD8"], "objects", "color_by", "CD8"),
}


def parser() -> argparse.ArgumentParser:
    made = argparse.ArgumentParser()
    flags.declare_source(made)
    return made


def test_each_setting_s_flag_is_typed_here() -> None:
    declared = {
        field.metadata["flag"].name
        for section in fields(Settings())
        for field in ([section] if section.metadata else fields(getattr(Settings(), section.name)))
        if field.metadata["flag"]
    }
    assert declared == set(TYPED)


@pytest.mark.parametrize("flag", TYPED)
def test_a_flag_becomes_its_setting(flag: str) -> None:
    words, section, key, value = TYPED[flag]
    given = flags.flags_of(parser().parse_args(["in.tif", flag, *words]))
    assert list(given) == [section]
    found = getattr(apply(Settings(), given, "here"), section)
    assert (found[key] if isinstance(found, dict) else getattr(found, key)) == value


def test_auto_is_a_level() -> None:
    options = parser().parse_args(["in.tif", "--level", "auto"])
    assert apply(Settings(), flags.flags_of(options), "here").plan.level == "auto"


def test_a_setting_s_comment_is_its_flag_s_help(capsys: pytest.CaptureFixture[str]) -> None:
    (field,) = fields(make_dataclass("O", [("n", int, setting(1, "how many", flag=Flag("--n")))]))
    made = argparse.ArgumentParser()
    flags.declare_setting(made, field.metadata["flag"], field)
    made.print_help()
    assert "how many" in capsys.readouterr().out
    assert made.parse_args(["--n", "7"]).n == 7


def test_a_length_or_auto_can_have_a_flag(capsys: pytest.CaptureFixture[str]) -> None:
    declared = setting("auto", "5 % of it, in um", flag=Flag("--n"))
    (field,) = fields(make_dataclass("O", [("n", float | str, declared)]))
    made = argparse.ArgumentParser()
    flags.declare_setting(made, field.metadata["flag"], field)
    assert made.parse_args(["--n", "1.5"]).n == 1.5
    assert made.parse_args(["--n", "auto"]).n == "auto"
    made.print_help()
    assert "5 % of it" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--series", "0"], "--series is '0', expected a number from 1, or `list`"),
        (["--tile-size", "8,9"], "--tile-size is '8,9', expected three numbers z,y,x"),
        (["--channels", "a,,b"], "--channels is 'a,,b', expected names or indices"),
        (["--iso-value", "=3"], "--iso-value is '=3', expected CHANNEL=VALUE"),
        (["--iso-value", "a=b"], "--iso-value is 'a=b', expected CHANNEL=VALUE"),
        (["--paint", "a="], "--paint is 'a=', expected CHANNEL=CHANNEL, such as CD31=MART1"),
    ],
)
def test_a_value_that_is_not_valid_is_refused_under_the_name_of_its_flag(
    words: list[str], message: str
) -> None:
    with pytest.raises(UsageError) as raised:
        parser().parse_args(["in.tif", *words])
    assert message in str(raised.value)


@pytest.mark.parametrize(
    "words",
    [
        ["plan", "", "-o", "out"],
        ["build", "in", "--out", ""],
        ["check", ""],
        ["export", "out", ""],
        ["publish", "out", ""],
        ["bundle", "out", "--stage", ""],
    ],
    ids=" ".join,
)
def test_an_empty_name_does_not_stand_for_the_current_folder(words: list[str]) -> None:
    """Scripts give an empty name if they have not set a variable."""
    with pytest.raises(UsageError, match="is empty, perhaps because a variable is not set"):
        _parser().parse_args(words)
