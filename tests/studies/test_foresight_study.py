"""The study of foresight: what it says of a run, by hand, and its page."""

import numpy as np
import pandas as pd
import pytest

from caregiver_mj.experiments.settings import EPSILONS
from caregiver_mj.experiments.verdicts import Verdict
from studies.foresight import ABLATIONS, COLUMNS, Bars, draw, page, variants

HOUSES, EPISODES = 6, 10
DAMAGE = {"none": 10.0, "paper": 4.0, "nearest": 4.0, "foresight": 3.0, "knows-goal": 2.8, "floor": 2.0}


@pytest.fixture
def bars():
    """Every house has its own level; foresight is worse than the rule in the first."""
    random = np.random.default_rng(0)
    rows = []
    for house in range(HOUSES):
        for family in ("0.5", "0.25"):
            noise = random.normal(0.0, 0.1, EPISODES)
            noise -= noise.mean()
            for name, damage in DAMAGE.items():
                level = 4.5 if house == 0 and name == "foresight" else damage
                for episode in range(EPISODES):
                    rows.append((f"h{house}", name, family, episode, level * (1 + noise[episode]), 10.0, 2.0))
    columns = ["house", "caregiver", "family", "episode", "damage", "toys_reached", "moves_blocked_free"]
    return Bars("made", pd.DataFrame(rows, columns=columns))


class TestBars:
    def test_left(self, bars):
        assert bars.left("paper", "0.5").value == pytest.approx(0.4)
        assert bars.left("foresight", "0.5").value == pytest.approx((5 * 3.0 + 4.5) / 60)

    def test_what_is_closed_and_removed(self, bars):
        below = sum([4.0 - 4.5, *[4.0 - 3.0] * 5])
        assert bars.removed(("0.5", "0.25")).value == pytest.approx(below / (6 * 2.0))
        assert bars.closed(("0.5",)).value == pytest.approx(below / (6 * 1.2))
        low, high = bars.removed(("0.5",))[1:]
        assert low < below / 12 < high

    def test_houses(self, bars):
        assert (bars.houses_with("paper", "0.25"), bars.clear("paper", "0.25")) == ((5, 0, 1), (5, 1))

    def test_the_child(self, bars):
        ratio, verdict = bars.toys("0.5")
        assert ratio.value == 1
        assert verdict == Verdict.NOT_INFERIOR
        assert (bars.denied("0.5")[0], bars.denied("0.5")[1].value) == (2, 0)

    def test_against_the_rule(self, bars):
        found = bars.against("paper", ("0.5", "0.25"))
        assert found.estimate.value == pytest.approx(-(5 * 1.0 - 0.5) / 60)
        assert 0.03 < found.p < 0.2  # one of six houses has another sign

    def test_all_together(self, bars):
        # Two children in each of six houses: with the rule 8, with foresight 9 in the first house, 6 in five; floor 4
        houses, episodes = bars.reduction("paper")
        assert houses.estimate.value == pytest.approx(episodes.estimate.value) == pytest.approx((1 - 5 * 2) / 6)
        assert episodes.p < houses.p
        assert bars.gone("paper").value == pytest.approx(9 / 48)
        assert bars.gone("paper", "floor").value == pytest.approx(9 / 24)


def test_the_page_of_what_is_taken_apart():
    rows = [
        (f"h{house}", name, f"{epsilon:g}", episode, 3.0 + episode + (name == "none"), 5.0, 1.0, 2.0)
        for house in range(3)
        for name in variants()
        for epsilon in EPSILONS
        for episode in range(4)
    ]
    table = pd.DataFrame(rows, columns=["house", "caregiver", "family", "episode", *COLUMNS])
    text = page([], table).text("foresight", "the command")
    for what in ABLATIONS:
        assert f"| {what} |" in text
    assert "0.818" in text  # 4.5 / 5.5
    assert "Damage left over 3 houses of 4 episodes" in text
    assert len(draw(table).axes) == 2 * (len(EPSILONS) - 1)
