"""The channels that show when a specimen is opened."""

import pytest

from stereocell.planning.channels import Channel, shown_at_first

WHITE = (1.0, 1.0, 1.0)


def channels(*names: str, source: str = "") -> list[Channel]:
    return [Channel(i, name, WHITE, source=source) for i, name in enumerate(names)]


@pytest.mark.parametrize(
    ("names", "label_maps", "shown"),
    [
        (["DNA", "CD31"], [], {"DNA", "CD31"}),
        (["DNA", "A", "B", "C", "D", "E"], [], {"DNA", "A", "B", "C"}),
        (["Autofluorescence", "DNA", "background"], [], {"DNA"}),
        (["Autofluorescence"], [], {"Autofluorescence"}),
        (["DAPI", "AF488"], [], {"DAPI", "AF488"}),  # a dye
        (["DNA", "CD31"], ["cells"], {"cells"}),
        ([], ["a", "b", "c", "d", "e"], {"a", "b", "c", "d"}),
    ],
)
def test_the_first_stains_show_or_only_the_label_maps(
    names: list[str], label_maps: list[str], shown: set[str]
) -> None:
    assert shown_at_first(channels(*names), label_maps) == shown


def test_only_the_brain_shows_of_a_head_with_tissue_classes() -> None:
    head = channels("skin", "grey matter", "white matter", "CSF", source="classes.nii")
    assert shown_at_first(head) == {head[1].id, head[2].id}
