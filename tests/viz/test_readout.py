"""What the panel in a browser says of a moment."""

import re

import numpy as np
from test_forecast import forecast
from test_hud import PLAN, state

from caregiver_mj.viz.viewers.web_panel import readout


def values(text, kind):
    return re.findall(rf'class="{kind}"[^>]*>([^<]*)<', text)


def test_what_is_happening():
    text = readout(state(timestep=17, family="1,0.25", damage=5.0, damages={"stairs": 5.0}, intervention="<go>"))
    assert (values(text, "timestep"), values(text, "epsilon")) == (["17"], ["1, 0.25"])
    assert (values(text, "damage"), values(text, "doing")) == (["5"], ["&lt;go&gt;"])
    assert "stairs 5" in text


def test_danger_of_every_hazard():
    danger = np.linspace(0.5, 2.0, len(PLAN.hazards))
    text = readout(state(danger=danger, target=1))
    assert values(text, "danger") == [f"{value:.2f}" for value in danger]
    for number, hazard in enumerate(PLAN.hazards):
        assert (f"<b>{hazard}</b>" in text) == (number == 1)
    widths = [int(share) for share in re.findall(r"width:(\d+)%", text)]
    assert max(widths) == 100  # the greatest fills its bar


def test_what_is_not_known_is_said():
    text = readout(state(child={"safe": None}, danger=None, robot=None, intervention=""))
    assert text.count("not estimated") == 2
    assert "there is no caregiver" in text
    assert "look ahead" in text


def test_what_is_foreseen():
    assert values(readout(state(forecast=forecast())), "believed") == ["0.50"]
    two = state().children * 2
    assert "children here within 5" in readout(state(children=two, forecast=forecast([{}, {}])))
