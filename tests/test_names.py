"""Names become identifiers and come back."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pxr import Sdf

from stereocell.names import from_identifier, to_identifier


@given(st.text(min_size=1, max_size=30))
def test_any_name_comes_back(name: str) -> None:
    identifier = to_identifier(name)
    assert from_identifier(identifier) == name
    assert re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", identifier)
    assert Sdf.Path.IsValidIdentifier(identifier)


@given(st.text(min_size=1, max_size=8), st.text(min_size=1, max_size=8))
def test_different_names_have_different_identifiers(a: str, b: str) -> None:
    assert (a == b) == (to_identifier(a) == to_identifier(b))


@pytest.mark.parametrize(
    ("name", "identifier"),
    [
        ("CD31", "CD31"),
        ("Hoechst 33342", "Hoechst_x20_33342"),
        ("1st", "_x31_st"),
        ("a_x20_", "a_x5f_x20_"),
    ],
)
def test_known_names(name: str, identifier: str) -> None:
    assert to_identifier(name) == identifier


def test_empty_name_is_refused() -> None:
    with pytest.raises(ValueError, match="empty"):
        to_identifier("")
