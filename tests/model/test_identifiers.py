"""Names are converted to identifiers and back."""

import re
from pathlib import PureWindowsPath

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pxr import Sdf

from stereocell.model.identifiers import MAX_LENGTH, from_identifier, to_identifier

PORTS = {f"{port}{n}" for port in ("COM", "LPT") for n in range(10)}
DEVICES = {"CON", "PRN", "AUX", "NUL"} | PORTS


@given(st.text(min_size=1, max_size=20))
def test_any_name_is_recovered_from_its_identifier(name: str) -> None:
    assert from_identifier(to_identifier(name)) == name


@given(st.text(min_size=1, max_size=300))
def test_identifiers_are_valid_and_of_limited_length(name: str) -> None:
    identifier = to_identifier(name)
    assert len(identifier) <= MAX_LENGTH
    assert re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", identifier)
    assert Sdf.Path.IsValidIdentifier(identifier)


@given(st.text(min_size=1, max_size=8), st.text(min_size=1, max_size=8))
def test_different_names_have_different_identifiers(a: str, b: str) -> None:
    assert (a == b) == (to_identifier(a) == to_identifier(b))


@given(st.text(alphabet="_xh5f\u6f22", max_size=12), st.text(alphabet="_xh5f\u6f22", max_size=12))
def test_long_names_have_identifiers_of_their_own(a: str, b: str) -> None:
    long = "\u6f22" * 24
    assert (a == b) == (to_identifier(long + a) == to_identifier(long + b))
    # a name that looks like a shortened identifier is not mistaken for one
    shortened = to_identifier(long + long)
    assert to_identifier(shortened) != shortened


def test_a_name_cut_short_keeps_its_beginning() -> None:
    name = "\u6f22\u5b57 of a very long name " * 10
    identifier = to_identifier(name)
    assert len(identifier) > MAX_LENGTH - 10
    shown = from_identifier(identifier)
    assert shown.endswith("\u2026")
    assert name.startswith(shown[:-1])
    assert len(shown) > 20
    assert from_identifier(to_identifier("_xh" + "0" * 20 + "_")) == "_xh" + "0" * 20 + "_"


@pytest.mark.parametrize(
    ("name", "identifier"),
    [
        ("CD31", "CD31"),
        ("Hoechst 33342", "Hoechst_x20_33342"),
        ("1st", "_x31_st"),
        ("a_x20_", "a_x5f_x20_"),
        ("\u03b5", "_x3b5_"),
        ("//", "_x2f__x2f_"),
        ("Con", "_x43_on"),
        ("lpt1", "_x6c_pt1"),
        ("Conus", "Conus"),
        ("A" * 180, "A" * 180),
    ],
)
def test_known_names_have_the_documented_identifiers(name: str, identifier: str) -> None:
    assert to_identifier(name) == identifier


@given(
    st.text(min_size=1, max_size=300)
    | st.sampled_from(["CON", "nul", "Com1", "LPT9", "aux.", "a:b", "x ", "..", "NUL\n", "prn.txt"])
)
def test_windows_accepts_identifiers_as_file_names(name: str) -> None:
    identifier = to_identifier(name)
    for file in (identifier, f"{identifier}.glb"):
        path = PureWindowsPath(file)
        assert path.parts == (file,)  # Windows sees no drive and no folder in it
        assert path.stem.upper() not in DEVICES
        assert not set(file) & set('<>:"/\\|?*')
        assert file[-1] not in ". "


def test_an_empty_name_is_refused() -> None:
    with pytest.raises(ValueError, match="empty"):
        to_identifier("")
