"""Offscreen rendering comes up headless, at first use, with the backend that the user wants or that works."""

import os
import subprocess
import sys

import pytest

SCENE = (
    "<mujoco><visual><global offwidth='64' offheight='48'/></visual><worldbody><light pos='0 -2 3'/>"
    "<geom size='1' rgba='1 0 0 1'/><camera name='side' pos='0 -4 0' xyaxes='1 0 0 0 0 1'/></worldbody></mujoco>"
)
RENDER = f"""
from dm_control import mujoco
class Physics(rendering.OffscreenRendering, mujoco.Physics):
    pass
physics = Physics.from_xml_string({SCENE!r})
try:
    frame = physics.render(48, 64, camera_id="side")
except rendering.CaregiverError as error:
    print(type(error).__name__, error)
else:
    red, green, _ = frame[24, 32]
    print(type(physics.contexts.gl).__name__, frame.shape, "red" if red > 50 + green else "not red")
"""


def run(code: str, **environment: str | None) -> str:
    """Runs code in a fresh interpreter and returns what it prints; None takes a variable out of the environment."""
    variables = {**os.environ, "MUJOCO_GL": None, "PYOPENGL_PLATFORM": None, **environment}
    wanted = {name: value for name, value in variables.items() if value is not None}
    done = subprocess.run([sys.executable, "-c", code], env=wanted, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    return done.stdout.strip()


def test_import_touches_no_opengl():
    modules = "[m for m in sys.modules if m.split('.')[0] == 'OpenGL']"
    libraries = "[line for line in open('/proc/self/maps') if 'libEGL' in line or 'libOSMesa' in line]"
    code = "import os, sys; import caregiver_mj; from caregiver_mj.house import rendering; import dm_control.mujoco\n"
    assert run(code + f"print({modules}, {libraries}, os.environ.get('MUJOCO_GL'))") == "[] [] None"


def test_renders_without_display():
    code = f"from dm_control import mujoco; from caregiver_mj.house import rendering{RENDER}"
    printed = run(code, DISPLAY=None, WAYLAND_DISPLAY=None)
    assert printed in ("EglContext (48, 64, 3) red", "OSMesaContext (48, 64, 3) red")


@pytest.mark.parametrize("wish", ["egl", "osmesa"])
def test_user_choice_wins(wish):
    printed = run(f"from caregiver_mj.house import rendering{RENDER}", MUJOCO_GL=wish)
    context = {"egl": "EglContext", "osmesa": "OSMesaContext"}[wish]
    if printed.startswith("RenderingError"):  # not on this machine; then it must not have tried the other
        other = {"egl": "osmesa", "osmesa": "egl"}[wish]
        assert f"({wish}: " in printed
        assert f"{other}: " not in printed
    else:
        assert printed == f"{context} (48, 64, 3) red"


WITHOUT = "import sys; sys.modules['dm_control'] = None"  # as if it were not installed
COMMAND = "import sys; sys.stderr = sys.stdout; from caregiver_mj.cli import main; print(main({}))"
SHORT = ["--epsilon", "1", "--episodes", "1", "--out", "run"]
HOUSE = {
    "load": "import caregiver_mj; caregiver_mj.load('supervise')",
    "evaluate": COMMAND.format(["evaluate", "--world", "house", *SHORT]),
}


@pytest.mark.parametrize("use", HOUSE)
def test_without_dm_control_the_house_says_what_brings_it(use, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code = f"{WITHOUT}\ntry:\n    {HOUSE[use]}\nexcept ImportError as error:\n    print(error)"
    wanted = "the house requires dm_control: pip install --no-deps dm_control==1.0.50"
    assert run(code) in (wanted, f"caregiver-mj: {wanted}\n2")


def test_the_grid_does_without_dm_control(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    grid = COMMAND.format(["evaluate", "--world", "grid", *SHORT])
    assert run(f"{WITHOUT}\n{grid}").endswith("\n0")


def test_the_house_says_that_mujoco_is_too_new(tmp_path):
    (tmp_path / "mujoco-4.0.0.dist-info").mkdir()
    (tmp_path / "mujoco-4.0.0.dist-info" / "METADATA").write_text("Name: mujoco\nVersion: 4.0.0\n")
    code = f"try:\n    {HOUSE['load']}\nexcept ImportError as error:\n    print(error)"
    printed = run(code, PYTHONPATH=str(tmp_path))
    assert printed == "the house requires MuJoCo below 4, got 4.0.0: pip install 'mujoco<4'"
