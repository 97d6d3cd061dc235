"""The study of two children: its rows, its page and its figure."""

import itertools

import pytest

from studies.several_children import CAREGIVERS, FAMILIES, draw, measure, page, rows


@pytest.fixture(scope="module")
def found():
    return rows(measure(["paper"], ["grid"], {"grid": 6}, jobs=1))


def test_a_row_for_every_caregiver_and_family(found):
    wanted = list(itertools.product(FAMILIES, CAREGIVERS["grid"]))
    assert [(row["family"], row["caregiver"]) for row in found] == wanted
    for row in found:
        assert sum(row["by_child"]) == pytest.approx(row["damage"])
        assert (row["left"][0] == 1.0) == (row["caregiver"] == "none")


def test_page_and_figure(found):
    text = page(found).text("several_children", "the command")
    assert text.startswith("# Two children\n")
    lines = text.splitlines()
    assert sum(line.startswith("| grid | paper | 1,0.25 |") for line in lines) == 1 + len(CAREGIVERS["grid"])
    assert "Means of 6 episodes in the grid" in text
    assert draw(found).axes[0].get_title() == "grid 'paper'"
