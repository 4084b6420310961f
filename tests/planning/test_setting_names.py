"""Errors name settings by flags on the command line, and by section and key in Python."""

from pathlib import Path

import pytest

import stereocell
from stereocell.cli.__main__ import main
from stereocell.planning.setting_names import flagged_settings, in_flags, in_settings
from support import phantoms


@pytest.fixture
def source(tmp_path: Path) -> Path:
    return phantoms.write_ome_tiff(tmp_path / "f.ome.tif", phantoms.f_phantom(), names=["F"])


WRONG = [
    (["--iso-scope", "slide"], "--iso-scope is 'slide', expected one of channel, tile"),
    (["--iso-criterion", "x"], "--iso-criterion is 'x', expected one of levels"),
    (["--as", "labels"], "--as is 'labels', expected intensity"),
    (["--spacing-um", "0,1,1"], "--spacing-um is 0,1,1, expected z,y,x in um"),
    (["--axes", "zz"], "--axes is 'zz', expected z, y and x"),
    (["--time=-1"], "--time is -1, expected 0 or more"),
    (["--wrap", "film"], "--wrap is 'film', expected one of voxels"),
    (["--iso-value", "F=1+c"], "--iso-value F is '1+c', expected a voxel value"),
    (["--window", "F=9:1"], "--window F is '9:1', expected"),
    (["--bits", "12"], "--bits is 12, expected 8 or 16"),
    (["--level", "7"], "--level is 7, expected 0 to 0"),
]


@pytest.mark.parametrize(("flags", "message"), WRONG)
def test_an_error_names_a_flag_as_it_was_typed(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], flags: list[str], message: str
) -> None:
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), *flags]) == 2
    line = capsys.readouterr().err.strip()
    assert line.startswith(f"stereocell: {message}")
    assert "\n" not in line


def test_an_error_names_a_setting_as_the_file_does(
    source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "my.toml").write_text('[isovalue]\nscope = "slide"\n')
    given = ["--config", str(tmp_path / "my.toml"), "--iso-criterion", "edges"]
    assert main(["plan", str(source), "-o", str(tmp_path / "out"), *given]) == 2
    assert "isovalue.scope is 'slide', expected one of" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"plan": {"level": 7}}, "plan.level is 7, expected 0 to 0"),
        ({"plan": {"grid": "2by1"}}, "plan.grid is '2by1', expected columns x rows"),
        ({"isovalue": {"scope": "slide"}}, "isovalue.scope is 'slide', expected one of"),
        ({"iso_values": {"G": 3.0}}, "iso_values names channel 'G', expected one of F"),
        ({"surfaces": {"F": "outermost"}}, "surfaces.F: found 'outermost', expected outer"),
    ],
)
def test_an_error_in_python_names_the_setting(
    source: Path, tmp_path: Path, settings: dict[str, dict[str, object]], message: str
) -> None:
    with pytest.raises(stereocell.StereoCellError) as caught:
        stereocell.build(source, tmp_path / "out", settings=settings)
    assert str(caught.value).startswith(message)


def test_an_error_of_open_volume_names_its_argument(source: Path) -> None:
    with pytest.raises(stereocell.StereoCellError) as caught:
        stereocell.open_volume(source, series=2)
    assert f"{source}: series: found 2, expected" in str(caught.value)
    assert "--" not in str(caught.value)


def test_each_flag_can_be_replaced_by_its_setting_and_back() -> None:
    names = [flag.name for flag, _, _ in flagged_settings()]
    assert len(names) == len(set(names))
    for flag, place, _ in flagged_settings():
        if len(place) == 2:
            assert in_settings(f"{flag.name} is 3") == f"{'.'.join(place)} is 3"
            assert in_flags(f"{'.'.join(place)} is 3", [flag.name]) == f"{flag.name} is 3"
        else:
            assert in_settings(f"{flag.name} CD8: found 3") == f"{place[0]}.CD8: found 3"
            assert in_flags(f"{place[0]}.CD8 is 3", [flag.name]) == f"{flag.name} CD8 is 3"
    assert in_flags("plan.level is 3", ["--grid"]) == "plan.level is 3"
