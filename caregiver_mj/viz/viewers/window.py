"""A session in MuJoCo's viewer, a window on this machine's display."""

from __future__ import annotations

import copy
import dataclasses
import math
import queue
import threading
import time
from collections.abc import Callable

import glfw
import mujoco
import mujoco.viewer

from caregiver_mj.caregivers.registry import PERSON
from caregiver_mj.errors import RenderingError
from caregiver_mj.viz.cameras import draw_label, draw_tiles
from caregiver_mj.viz.moment import HudState, place_of
from caregiver_mj.viz.viewers import KEYS, Session

_PERIOD = 1 / 60  # s between updates
_KEYS: dict[int, Callable[[Session], None]] = {
    glfw.KEY_SPACE: Session.toggle,
    glfw.KEY_RIGHT: Session.step,
    glfw.KEY_DOWN: Session.next_move,
    glfw.KEY_EQUAL: lambda session: session.hurry(2.0),
    glfw.KEY_MINUS: lambda session: session.hurry(0.5),
    glfw.KEY_N: lambda session: session.change(episode=(session.spec.episode or 0) + 1),
    glfw.KEY_R: Session.change,
}
_HELP = (
    "space\nright\ndown\n= -\nR N",
    "pause, go on\none step of 0.02 s\nto the next move\nfaster, slower\nagain, next episode",
)
_LAST_PICTURE = 20.0  # s; greatest time for the last picture
_CAMERA = "overview"
_LOWEST = 0.04  # m; lower tiles are too close to rugs for the window's depth buffer
_BAR = 20  # characters of a full bar


class Window:
    """Shows a session in a window, which draws a copy of the state, so that neither waits for the other."""

    def __init__(self, session: Session):
        """Open the window, or raise RenderingError."""
        self.session = session
        self._pressed: queue.SimpleQueue[int] = queue.SimpleQueue()
        physics = session.episode.env.physics
        self._model = copy.copy(physics.model.ptr)
        self._model.vis.global_.fovy = self._model.camera(_CAMERA).fovy[0]
        self._data = mujoco.MjData(self._model)
        if not glfw.init():  # the viewer would wait for ever
            raise RenderingError("no window can be opened: use `caregiver-mj view --web` and a browser")
        before = set(threading.enumerate())
        try:
            self._viewer = mujoco.viewer.launch_passive(
                self._model, self._data, key_callback=self._pressed.put, show_left_ui=False, show_right_ui=False
            )
        except RuntimeError as error:  # on macOS without mjpython
            raise RenderingError(f"no window can be opened ({error}): `caregiver-mj view --web` needs none") from None
        self._drawing = set(threading.enumerate()) - before
        with self._viewer.lock():
            option, scene = self._viewer.opt, self._viewer.user_scn
            self._flags = [(flags, flags.copy()) for flags in (option.geomgroup, option.flags, scene.flags)]
            self._viewer.cam.type = mujoco.mjtCamera.mjCAMERA_FREE
            place, ahead, distance = session.episode.overview()
            self._viewer.cam.lookat[:], self._viewer.cam.distance = place + distance * ahead, distance
            self._viewer.cam.azimuth, self._viewer.cam.elevation = 90.0, math.degrees(math.asin(ahead[2]))

    def run(self) -> None:
        """Run the session until the window is closed, or an interruption."""
        while self._viewer.is_running():
            due = time.monotonic() + _PERIOD
            while not self._pressed.empty():
                press(self.session, self._pressed.get())
            self.session.advance()
            self.show()
            time.sleep(max(due - time.monotonic(), 0.0))

    def show(self) -> None:
        """Show the present moment."""
        episode = self.session.episode
        with self._viewer.lock():
            mujoco.mj_copyData(self._data, self._model, episode.env.physics.data.ptr)
            self._viewer.user_scn.ngeom = 0
            raised = [dataclasses.replace(tile, height=max(tile.height, _LOWEST)) for tile in episode.tiles()]
            draw_tiles(self._viewer.user_scn, raised)
            state = episode.hud_state(trail_length=1)
            if self.session.targets:  # the viewer has commands on the same keys, which would hide things
                for flags, before in self._flags:
                    flags[:] = before
            if self.session.spec.caregiver == PERSON:
                for number, (key, *_) in enumerate(self.session.targets[1:]):
                    draw_label(self._viewer.user_scn, key, place_of(state.plan, number, state.candles))
        names, values = texts(state, self.session)
        top, bottom = mujoco.mjtGridPos.mjGRID_TOPLEFT, mujoco.mjtGridPos.mjGRID_BOTTOMLEFT
        font = mujoco.mjtFontScale.mjFONTSCALE_100
        self._viewer.set_texts([(font, top, names, values), (font, bottom, *_HELP)])
        self._viewer.sync()

    def close(self) -> None:
        """Close the window, and wait for its last picture; a process that ends during it hangs."""
        self._viewer.close()
        for thread in self._drawing:
            thread.join(_LAST_PICTURE)


def press(session: Session, key: int) -> None:
    """Apply a key, by its number in GLFW."""
    if key in _KEYS:
        _KEYS[key](session)
    elif key in map(ord, KEYS):
        session.choose(chr(key))


def texts(state: HudState, session: Session) -> tuple[str, str]:
    """Return the text in a corner of the window, as two columns."""
    rows = [
        ("caregiver", state.intervention or "none"),
        ("timestep", str(state.timestep)),
        ("epsilon", state.family),
        ("speed", "over" if session.over else f"{session.speed:g}" if session.playing else "paused"),
        ("damage", f"{state.damage:g}"),
    ]
    for number, child in enumerate(state.children):
        if child.safe is not None:
            rows.append(("P(safe)" if len(state.children) == 1 else f"P(safe) {number + 1}", _bar(child.safe)))
    rows += [(f"{key}  {name}", mark) for key, name, mark in session.targets]
    if state.danger is not None:
        full = max(1.0, float(state.danger.max(initial=0.0)))
        for number, hazard in enumerate(state.plan.hazards):
            mark = " <" if number == state.target else ""
            rows.append((str(hazard), _bar(float(state.danger[number]), full) + mark))
    names, values = zip(*rows, strict=True)
    return "\n".join(names), "\n".join(values)


def _bar(value: float, full: float = 1.0) -> str:
    return f"{value:.2f} {'|' * round(_BAR * value / full)}"
