"""What a panel in a browser says of a moment: what the caregiver does, what it expects, and what has happened."""

from __future__ import annotations

import html

import numpy as np

from caregiver_mj.caregivers.outlook import HORIZON
from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import Colour
from caregiver_mj.viz.forecast import SOON
from caregiver_mj.viz.hud.state import HudState

_FULL_BAR = 1.0  # expected danger of a full bar, unless one is greater
_STYLE = "font-size:13px;line-height:1.5;padding:2px 14px 2px 8px"
_TRACK = "background:#8884;border-radius:3px;height:9px;flex:1;overflow:hidden"


def readout(state: HudState) -> str:
    """The whole, as HTML. Every value has a class, for whoever looks for it."""
    parts = [_deeds(state), _safety(state), _danger(state), _foreseen(state)]
    return f'<div style="{_STYLE}">{"".join(parts)}</div>'


def _deeds(state: HudState) -> str:
    doing = state.intervention or "there is no caregiver"
    kinds = ", ".join(f"{kind} {damage:g}" for kind, damage in (state.damages or {}).items())
    each = "".join(
        f' <span style="{_dot(colours.of_child(number))}"></span>{child.damage:g}'
        for number, child in enumerate(state.children if len(state.children) > 1 else ())
    )
    return (
        f'<div><b class="doing">{html.escape(doing)}</b></div>'
        f'<div>timestep <span class="timestep">{state.timestep}</span> of {EPISODE_TIMESTEPS}, '
        f'epsilon <span class="epsilon">{html.escape(state.family.replace(",", ", "))}</span></div>'
        f'<div>damage <b class="damage">{state.damage:g}</b>{each}{f" ({kinds})" if kinds else ""}</div>'
    )


def _safety(state: HudState) -> str:
    if all(child.safe is None for child in state.children):
        return _head("P(safe)") + "<div>not estimated</div>"
    names = [""] if len(state.children) == 1 else [f"child {number + 1}" for number in range(len(state.children))]
    rows = (
        _row(name, child.safe or 0.0, f"{child.safe or 0.0:.2f}", colours.of_child(number), "safe")
        for number, (name, child) in enumerate(zip(names, state.children, strict=True))
    )
    return _head("P(safe)") + "".join(rows)


def _danger(state: HudState) -> str:
    if state.danger is None:
        return _head("Expected danger") + "<div>not estimated</div>"
    full = max(_FULL_BAR, float(np.max(state.danger, initial=0.0)))
    rows = []
    for number, hazard in enumerate(state.plan.hazards):
        value, name = float(state.danger[number]), str(hazard)
        if number == state.target:
            name = f"<b>{name}</b>"
        rows.append(_row(name, value / full, f"{value:.2f}", colours.HAZARDS[hazard.kind], "danger"))
    return _head("Expected danger") + "".join(rows)


def _foreseen(state: HudState) -> str:
    if state.forecast is None:
        return _head("Foreseen") + "<div>nothing: <i>foresight</i> and <i>paper-predictive</i> look ahead</div>"
    epsilons = ", ".join(f"{epsilon:.2f}" for epsilon in state.forecast.epsilon)
    child = "child" if len(state.children) == 1 else "children"
    return (
        _head("Foreseen, on the floor")
        + f'<div><span style="{_dot(colours.of_child(0))}"></span> {child} here within {SOON} timesteps</div>'
        + f'<div><span style="{_dot(colours.HARM)}"></span> hurt here within {HORIZON} timesteps</div>'
        + f'<div>epsilon that it believes in: <span class="believed">{epsilons}</span></div>'
    )


def _head(text: str) -> str:
    return f'<div style="margin-top:6px;font-weight:600">{text}</div>'


def _row(name: str, share: float, value: str, colour: Colour, kind: str) -> str:
    filled = f"width:{100 * min(max(share, 0.0), 1.0):.0f}%;height:100%;background:{_css(colour)}"
    return (
        f'<div style="display:flex;align-items:center;gap:6px"><span style="width:6.5em">{name}</span>'
        f'<div style="{_TRACK}"><div style="{filled}"></div></div>'
        f'<span class="{kind}" style="width:2.6em;text-align:right">{value}</span></div>'
    )


def _dot(colour: Colour) -> str:
    return f"display:inline-block;width:10px;height:10px;border-radius:5px;background:{_css(colour)}"


def _css(colour: Colour) -> str:
    return f"rgb({colour[0]},{colour[1]},{colour[2]})"
