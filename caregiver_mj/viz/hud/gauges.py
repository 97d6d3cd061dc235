"""Time, and how safely the children behave."""

from __future__ import annotations

from PIL import Image

from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import TEXT, Colour
from caregiver_mj.viz.hud.area import Area
from caregiver_mj.viz.hud.cards import LABEL, TRACK
from caregiver_mj.viz.hud.state import ChildState, HudState
from caregiver_mj.viz.hud.text import width_of, write

_SAFE = "P(SAFE)"


def draw_gauges(image: Image.Image, area: Area, state: HudState) -> None:
    """Draws the timestep above P(safe), which is that of each child."""
    elapsed = state.timestep / EPISODE_TIMESTEPS
    _gauge(image, area, area.top, "TIMESTEP", f"{state.timestep} / {EPISODE_TIMESTEPS}", elapsed, LABEL)
    lower = area.top + area.row
    safe = state.children[0].safe
    if all(child.safe is None for child in state.children):
        _gauge(image, area, lower, _SAFE, "not estimated", 0.0, colours.ROBOT)
    elif len(state.children) == 1 and safe is not None:
        _gauge(image, area, lower, _SAFE, f"{safe:.2f}", safe, colours.ROBOT)
    else:
        _gauges(image, area, lower, state.children)


def _gauge(image: Image.Image, area: Area, top: int, label: str, value: str, share: float, colour: Colour) -> None:
    """A label, its value, and below them a bar that is filled to a share."""
    line = top + area.medium
    write(image, (area.left, line), label, area.small, LABEL)
    write(image, (area.right, line), value, area.medium if share else area.small, TEXT, align=1)
    _bar(image, area, line, area.left, area.right, share, colour)


def _gauges(image: Image.Image, area: Area, top: int, children: tuple[ChildState, ...]) -> None:
    """One label, and beside it a narrow gauge for each child: its number, its value if there is room, and its bar."""
    small, gap, line = area.small, area.scale.px(8), top + area.medium
    start, label = area.left, width_of(_SAFE, small) + gap
    if label + len(children) * (width_of("8", small) + gap) <= area.width:
        write(image, (start, line), _SAFE, small, LABEL)
        start += label
    pitch = (area.right - start + gap) / len(children)
    for place, child in enumerate(children):
        left, right = round(start + place * pitch), round(start + (place + 1) * pitch) - gap
        number, colour = str(place + 1), colours.of_child(place)
        write(image, (left, line), number, small, colour)
        value = _value(child.safe, small, right - left - width_of(f"{number} ", small))
        write(image, (right, line), value, small, TEXT, align=1)
        _bar(image, area, line, left, right, child.safe or 0.0, colour)


def _value(safe: float | None, size: int, width: int) -> str:
    """A probability as exactly as there is room for."""
    wordings = () if safe is None else (f"{safe:.2f}", f"{safe:.2f}".lstrip("0"), f"{safe:.1f}".lstrip("0"))
    return next((wording for wording in wordings if width_of(wording, size) <= width), "")


def _bar(image: Image.Image, area: Area, line: int, left: int, right: int, share: float, colour: Colour) -> None:
    """A bar below a line of text."""
    top, filled = line + area.scale.px(8), left + round((right - left) * min(max(share, 0.0), 1.0))
    image.paste(TRACK, (left, top, right, top + area.scale.px(6)))
    image.paste(colour, (left, top, filled, top + area.scale.px(6)))
