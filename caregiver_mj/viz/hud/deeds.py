"""What the caregiver does, and the damage so far."""

from __future__ import annotations

from collections.abc import Mapping

from PIL import Image

from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import TEXT
from caregiver_mj.viz.hud.area import Area
from caregiver_mj.viz.hud.cards import LABEL
from caregiver_mj.viz.hud.state import HudState
from caregiver_mj.viz.hud.text import fit, width_of, write


def draw_deeds(image: Image.Image, area: Area, state: HudState) -> None:
    """Draws the caregiver's intervention above the damage: the sum, that of each child, and that of each kind."""
    small, medium, px = area.small, area.medium, area.scale.px
    who = "CAREGIVER" if state.robot is not None else "NO CAREGIVER"
    line = area.top + small
    write(image, (area.left, line), who, small, LABEL)
    deed = fit((state.intervention,), medium, area.width)
    write(image, (area.left, line + px(8) + medium), deed, medium, colours.ROBOT)

    write(image, (area.left, area.bottom), "DAMAGE", small, LABEL)
    x = area.left + width_of("DAMAGE", small) + px(8)
    total = f"{state.damage:g}"
    write(image, (x, area.bottom), total, area.large, colours.DAMAGE if state.damage else TEXT)
    x += width_of(total, area.large)
    if len(state.children) > 1:
        x = _write_children(image, area, x + px(10), state)
    if state.damages:
        _write_kinds(image, area, x + px(10), state.damages, len(state.children) > 1)


def _write_children(image: Image.Image, area: Area, x: int, state: HudState) -> int:
    """Writes the damage of each child, in its colour; returns where that ends."""
    for number, child in enumerate(state.children):
        text = f"{number + 1}: {child.damage:g}"
        if x + width_of(text, area.small) > area.right:
            write(image, (x, area.bottom), "...", area.small, LABEL)
            return area.right
        write(image, (x, area.bottom), text, area.small, colours.of_child(number))
        x += width_of(text, area.small) + area.scale.px(8)
    return x


def _write_kinds(image: Image.Image, area: Area, x: int, damages: Mapping[str, float], several: bool) -> None:
    """Writes the damage of each kind from the right: in words, or else by their first letters."""
    wordings = tuple(
        "   ".join(f"{kind[:letters].capitalize()} {value:g}" for kind, value in damages.items()) for letters in (9, 1)
    )
    if several and width_of(wordings[-1], area.small) > area.right - x:
        return  # the children's own figures have taken the room
    text = fit(wordings, area.small, area.right - x)
    write(image, (area.right, area.bottom), text, area.small, LABEL, align=1)
