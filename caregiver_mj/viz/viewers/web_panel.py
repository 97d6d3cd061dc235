"""The panel beside the house: what one can do about the episode, and what there is to know of it."""

from __future__ import annotations

import html
from collections.abc import Callable

import numpy as np
import viser

from caregiver_mj.caregivers.percept import HORIZON
from caregiver_mj.caregivers.registry import CAREGIVERS, POLICIES
from caregiver_mj.children.family import CHILDREN, NOVICE, Family
from caregiver_mj.children.tape import EPISODE_TIMESTEPS
from caregiver_mj.errors import CaregiverError
from caregiver_mj.plans import sets
from caregiver_mj.plans.floor_plan import house_names
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import Colour
from caregiver_mj.viz.forecast import SOON
from caregiver_mj.viz.hud.state import HudState
from caregiver_mj.viz.viewers.session import Session

_SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "5", "10", "20")
_STEPS: dict[str, Callable[[Session], None]] = {"0.02 s": Session.step, "1 move": Session.next_move}
_NOTE = "padding:2px 14px 2px 8px;font-size:13px;overflow-wrap:anywhere"
_MOST = 9  # children that can be asked for here
Do = Callable[[Callable[[], None]], None]  # has something done in the thread of the simulation
_FULL_BAR = 1.0  # expected danger of a full bar, unless one is greater
_STYLE = "font-size:13px;line-height:1.5;padding:2px 14px 2px 8px"
_TRACK = "background:#8884;border-radius:3px;height:9px;flex:1;overflow:hidden"


class Panel:
    """The panel of a session, in all browsers that look at a server.

    Attributes:
        foreseen: Whether to lay on the floor what the caregiver foresees.
    """

    def __init__(self, server: viser.ViserServer, session: Session, do: Do):
        """Lay the panel out.

        Args:
            server: What browsers are connected to.
            session: What is shown.
            do: Has something done in the thread of the simulation; what browsers do arrives in others.
        """
        self._gui, self._session, self._do = server.gui, session, do
        self._files = {session.watched.house}
        self._wrong: bool
        self._add_controls()
        self._readout = self._gui.add_html("")
        self._add_form()
        self._told = self._gui.add_html("")
        self._same = self._gui.add_html("")

    @property
    def foreseen(self) -> bool:
        return self._floor.value

    def show(self) -> None:
        """Show the present moment."""
        session = self._session
        self._play.label = "Pause" if session.playing else "Play"
        self._readout.content = readout(session.episode.hud_state(trail_length=1))
        if session.over:
            self.tell("The episode is over.")
        elif session.behind:
            self.tell("This machine is too slow for that speed.")
        elif not session.playing:
            self.tell("Paused.")
        else:
            self.tell("")

    def tell(self, text: str, wrong: bool = False) -> None:
        """Say something below the form; what is wrong stays until the next episode begins."""
        if wrong or not self._wrong:
            colour = "color:#c92a2a;" if wrong else ""
            self._told.content = f'<div class="told" style="{colour}{_NOTE}">{html.escape(text)}</div>'
            self._wrong = wrong

    def fill_in(self) -> None:
        """Enter into the form what is shown now."""
        self._wrong = False
        watched = self._session.watched
        alike = set(map(str, watched.family.children))
        # mypy does not see that viser lets these be set.
        self._house.value = watched.house  # type: ignore[misc]
        self._epsilon.value = alike.pop() if len(alike) == 1 else str(watched.family)  # type: ignore[misc]
        self._children.value, self._child.value = len(watched.family), NOVICE  # type: ignore[misc]
        self._caregiver.value = watched.caregiver  # type: ignore[misc]
        self._seed.value, self._number.value = watched.seed, watched.number  # type: ignore[misc]
        command = html.escape(f"caregiver-mj render {watched.options()} --out film.mp4")
        self._same.content = f'<div style="{_NOTE}">A film of it: <code class="same">{command}</code></div>'

    # -- What there is ---------------------------------------------------------------------------

    def _add_controls(self) -> None:
        gui, session = self._gui, self._session
        self._play = gui.add_button("Pause", hint="Halt, or go on")
        self._play.on_click(lambda _: self._do(self._toggle))
        steps = gui.add_button_group("Step", tuple(_STEPS), hint="Halt, and go on by one step of the robot or children")
        steps.on_click(lambda event: self._do(lambda: _STEPS[event.target.value](session)))
        asked = f"{session.speed:g}"
        speeds = _SPEEDS if asked in _SPEEDS else (*_SPEEDS, asked)
        speed = gui.add_dropdown("Speed", speeds, initial_value=asked, hint="Times the speed of the simulated world")
        speed.on_update(lambda _: self._do(lambda: setattr(session, "speed", float(speed.value))))
        self._floor = gui.add_checkbox("Danger foreseen", True, hint="On the floor, if the caregiver looks ahead")

    def _add_form(self) -> None:
        gui, known = self._gui, tuple(dict.fromkeys([*CAREGIVERS, *POLICIES, self._session.watched.caregiver]))
        with gui.add_folder("Episode"):
            self._house = gui.add_text("House", "", hint=f"{', '.join(house_names())}, house-17, test-100/17")
            self._epsilon = gui.add_text("Epsilon", "", hint="Share of random moves: 0.5, or of each child: 1, 0.25")
            self._children = gui.add_number("Children", 1, min=1, max=_MOST, step=1)
            self._child = gui.add_dropdown("Child", tuple(CHILDREN), initial_value=NOVICE)
            self._caregiver = gui.add_dropdown("Caregiver", known, initial_value=self._session.watched.caregiver)
            self._seed = gui.add_number("Seed", 0, min=0, step=1)
            self._number = gui.add_number("Number", 0, min=0, step=1, hint="Of the episode, in the run of that seed")
            gui.add_button("Start").on_click(lambda _: self._do(self._start))
            again = gui.add_button_group("Or", ("Again", "Next"), hint="The same once more, or the next of the run")
            again.on_click(lambda event: self._do(self._again if event.target.value == "Again" else self._next))
        self._wrong = False

    # -- What is done in the thread of the simulation -----------------------------------------------

    def _toggle(self) -> None:
        self._session.pause() if self._session.playing else self._session.play()

    def _again(self) -> None:
        self._change()

    def _next(self) -> None:
        self._change(number=self._session.watched.number + 1)

    def _start(self) -> None:
        try:
            settings = {
                "house": self._named_house(),
                "family": self._family(),
                "caregiver": self._caregiver.value,
                "seed": int(self._seed.value),
                "number": int(self._number.value),
            }
        except CaregiverError as error:
            self.tell(str(error), wrong=True)
        else:
            self._change(**settings)

    def _change(self, **settings: object) -> None:
        self._wrong = False
        self.tell("The house is being made ...")
        try:
            self._session.change(**settings)
        except CaregiverError as error:
            self.tell(str(error), wrong=True)
        else:
            self.fill_in()

    def _named_house(self) -> str:
        """The house; files can be named on the command line only, for who knows who looks at this page."""
        name = self._house.value.strip()
        if name in self._files or name in house_names() or sets.house(name) is not None:
            return name
        raise CaregiverError(f"no house '{name}': a file is named on the command line, --house FILE")

    def _family(self) -> Family:
        family, count = Family.parse(self._epsilon.value, self._child.value), int(self._children.value)
        if len(family) == 1:
            return family.times(count)
        if len(family) != count:
            raise CaregiverError(f"epsilon must be of {count} children, got {family}, which is of {len(family)}")
        return family


def readout(state: HudState) -> str:
    """Return the whole, as HTML. Every value has a class, for whoever looks for it."""
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
        rows.append(_row(name, value / full, f"{value:.2f}", hazard.kind.colour, "danger"))
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
