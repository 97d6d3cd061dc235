"""The panel beside the house: controls of the episode, and its state."""

from __future__ import annotations

import functools
import html
import itertools
import shlex
from collections.abc import Callable
from typing import Any

import jinja2
import viser

from caregiver_mj.caregivers.percept import HORIZON
from caregiver_mj.caregivers.registry import CAREGIVERS, DRIVER, PLAYERS, POLICIES
from caregiver_mj.children.child_group import CHILDREN, NOVICE, ChildGroup
from caregiver_mj.children.random_stream import EPISODE_TIMESTEPS
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.plans import sets
from caregiver_mj.plans.floor_plan import FloorPlan, house_names
from caregiver_mj.viz import colours
from caregiver_mj.viz.moment import SOON, HudState
from caregiver_mj.viz.viewers import KEYS, Session

_SPEEDS = ("0.1", "0.25", "0.5", "1", "2", "5", "10", "20")
_STEPS: dict[str, Callable[[Session], None]] = {"0.02 s": Session.step, "1 move": Session.next_move}
_NOTE = "padding:2px 14px 2px 8px;font-size:13px;overflow-wrap:anywhere"
_MOST = 9  # greatest number of children in the form
Do = Callable[[Callable[[], None]], None]  # runs a function in the thread of the simulation


class Panel:
    """The panel of a session, in all connected browsers; its checkbox `foreseen` asks for predictions on the floor."""

    def __init__(self, server: viser.ViserServer, session: Session, do: Do):
        """Lay out the panel; `do` runs a function in the thread of the simulation."""
        self._gui, self._session, self._do = server.gui, session, do
        self._files = {session.spec.house}
        self._wrong: bool
        self._add_controls()
        self._readout = self._gui.add_html("")
        self._add_targets()
        self._add_form()
        self._message = self._gui.add_html("")
        self._same = self._gui.add_html("")

    def show(self) -> None:
        """Show the present moment."""
        session = self._session
        labels = tuple(" ".join(target).rstrip() for target in session.targets) or self._nobody
        if labels != self._targets.options:
            self._targets.options, self._targets.visible = labels, labels != self._nobody
        self._play.label = "Pause" if session.playing else "Play"
        self._readout.content = readout(session.episode.hud_state(trail_length=1))
        paused = "" if session.playing else "Paused."
        behind = "This machine is too slow for that speed." if session.behind else paused
        self.tell("The episode is over." if session.over else behind)

    def tell(self, text: str, wrong: bool = False) -> None:
        """Show a message below the form; an error stays until the next episode."""
        if wrong or not self._wrong:
            colour = "color:#c92a2a;" if wrong else ""
            self._message.content = f'<div class="told" style="{colour}{_NOTE}">{html.escape(text)}</div>'
            self._wrong = wrong

    def fill_in(self) -> None:
        """Fill the form with the present episode."""
        self._wrong = False
        spec = self._session.spec
        alike = set(map(str, spec.family.children))
        # viser's properties can be set, which mypy does not see.
        self._house.value = spec.house  # type: ignore[misc]
        self._epsilon.value = alike.pop() if len(alike) == 1 else str(spec.family)  # type: ignore[misc]
        self._children.value, self._child.value = len(spec.family), NOVICE  # type: ignore[misc]
        self._caregiver.value = spec.caregiver  # type: ignore[misc]
        self._seed.value, self._number.value = spec.seed, spec.episode or 0  # type: ignore[misc]
        command = html.escape(f"caregiver-mj render {options(spec)} --out film.mp4")
        self._same.content = f'<div style="{_NOTE}">A film of it: <code class="same">{command}</code></div>'
        self._same.visible = spec.caregiver not in PLAYERS

    # -- Widgets ---------------------------------------------------------------------------------

    def _add_controls(self) -> None:
        gui, session = self._gui, self._session
        self._play = gui.add_button("Pause", hint="Halt, or go on")
        self._play.on_click(lambda _: self._do(session.toggle))
        steps = gui.add_button_group("Step", tuple(_STEPS), hint="Halt, and go on by one step of the robot or children")
        steps.on_click(lambda event: self._do(lambda: _STEPS[event.target.value](session)))
        asked = f"{session.speed:g}"
        speeds = _SPEEDS if asked in _SPEEDS else (*_SPEEDS, asked)
        speed = gui.add_dropdown("Speed", speeds, initial_value=asked, hint="Times the speed of the simulated world")
        speed.on_update(lambda _: self._do(lambda: setattr(session, "speed", float(speed.value))))
        self.foreseen = gui.add_checkbox("Danger foreseen", True, hint="On the floor, if the caregiver looks ahead")

    def _add_targets(self) -> None:
        """Add the player's choices: buttons, and the keys with which their labels begin."""
        gui, session, self._nobody = self._gui, self._session, ("",)
        what = "Drive" if session.spec.caregiver == DRIVER else "Protect from"
        self._targets = gui.add_button_group(what, self._nobody, visible=False)
        self._targets.on_click(lambda event: self._choose(event.target.value[:1]))
        for key in KEYS if session.targets else ():
            command = gui.add_command(f"{what} {key}", hotkey=key)  # type: ignore[arg-type]  # a valid key
            command.on_trigger(functools.partial(self._choose, key))

    def _choose(self, key: str, event: object = None) -> None:
        self._do(lambda: self._session.choose(key))

    def _add_form(self) -> None:
        gui, known = self._gui, tuple(dict.fromkeys([*CAREGIVERS, *POLICIES, self._session.spec.caregiver]))
        with gui.add_folder("Episode"):
            self._house = gui.add_text("House", "", hint=f"{', '.join(house_names())}, house-17, test-100/17")
            self._epsilon = gui.add_text("Epsilon", "", hint="Share of random moves: 0.5, or of each child: 1, 0.25")
            self._children = gui.add_number("Children", 1, min=1, max=_MOST, step=1)
            self._child = gui.add_dropdown("Child", tuple(CHILDREN), initial_value=NOVICE)
            self._caregiver = gui.add_dropdown("Caregiver", known, initial_value=self._session.spec.caregiver)
            self._seed = gui.add_number("Seed", 0, min=0, step=1)
            self._number = gui.add_number("Number", 0, min=0, step=1, hint="Of the episode, in the run of that seed")
            gui.add_button("Start").on_click(lambda _: self._do(lambda: self._begin("Start")))
            again = gui.add_button_group("Or", ("Again", "Next"), hint="The same once more, or the next of the run")
            again.on_click(lambda event: self._do(lambda: self._begin(event.target.value)))
        self._wrong = False

    # -- In the thread of the simulation ------------------------------------------------------------

    def _begin(self, button: str) -> None:
        self._wrong = False
        self.tell("The house is being made ...")
        try:
            self._session.change(**self._settings(button))
        except CaregiverError as error:
            self.tell(str(error), wrong=True)
        else:
            self.fill_in()

    def _settings(self, button: str) -> dict[str, object]:
        """Return the fields that change in the episode that a button begins."""
        if button != "Start":
            return {} if button == "Again" else {"episode": (self._session.spec.episode or 0) + 1}
        return {
            **self._named_house(),
            "family": self._family(),
            "caregiver": self._caregiver.value,
            "seed": int(self._seed.value),
            "episode": int(self._number.value),
        }

    def _named_house(self) -> dict[str, object]:
        """Return the house; only the command line accepts files, because anyone may see this page."""
        name = self._house.value.strip()
        if name in self._files or name in house_names() or sets.house(name) is not None:
            plan = FloorPlan.load(name, damage=self._session.spec.plan.damage)
            return {"plan": plan, "file": "" if name == plan.name else name}
        raise CaregiverError(f"no house '{name}': a file is named on the command line, --house FILE")

    def _family(self) -> ChildGroup:
        """Return the children; only the command line accepts code."""
        if any(part.count(":") > 1 for part in self._epsilon.value.split(",")):
            raise CaregiverError(f"no child '{self._epsilon.value}': your own is named on the command line, --child")
        family, count = ChildGroup.parse(self._epsilon.value, self._child.value), int(self._children.value)
        if len(family) == 1:
            return family.times(count)
        if len(family) != count:
            raise CaregiverError(f"epsilon must be of {count} children, got {family}, which is of {len(family)}")
        return family


def options(spec: EpisodeSpec) -> str:
    """Return the command line options of an episode."""
    usual = EpisodeSpec(FloorPlan.load("paper"))
    said = {"house": spec.house, "epsilon": spec.family, "caregiver": spec.caregiver, "seed": spec.seed}
    said |= {} if spec.episode is None else {"episode": spec.episode}

    def of(one: EpisodeSpec) -> dict[str, Any]:
        more = {name: getattr(one, name) for name in ("embodiment", "sight", "child_speed")}
        return {"damage": one.plan.damage, **more, **one.queries.record()}

    said |= {name: value for name, value in of(spec).items() if value != of(usual)[name]}
    words = ((f"--{name.replace('_', '-')}", *([] if value is True else [str(value)])) for name, value in said.items())
    return shlex.join(itertools.chain(*words))


def readout(state: HudState) -> str:
    """Return the state as HTML."""
    known = {"of_child": colours.of_child, "harm": colours.HARM, "soon": SOON, "horizon": HORIZON}
    return _template().render(known, state=state, timesteps=EPISODE_TIMESTEPS)


@functools.cache
def _template() -> jinja2.Template:
    loader = jinja2.PackageLoader("caregiver_mj.viz.viewers", "")
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    return environment.get_template("readout.html")
