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
    wanted = {"MUJOCO_GL": None, "PYOPENGL_PLATFORM": None, **environment}
    variables = {**os.environ, **wanted}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={name: value for name, value in variables.items() if value is not None},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "Traceback" not in done.stderr
    return done.stdout.strip()


@pytest.fixture
def no_egl(tmp_path):
    """A folder in which the linker finds a libEGL and a libOSMesa that cannot be loaded."""
    for name in ("libEGL.so.1", "libOSMesa.so.8", "libOSMesa.so.6"):
        (tmp_path / name).touch()
    return str(tmp_path)


def test_import_touches_no_opengl():
    modules = "[m for m in sys.modules if m.split('.')[0] == 'OpenGL']"
    libraries = "[line for line in open('/proc/self/maps') if 'libEGL' in line or 'libOSMesa' in line]"
    code = "import os, sys; import caregiver_mj; from caregiver_mj.house import rendering; import dm_control.mujoco\n"
    assert run(code + f"print({modules}, {libraries}, os.environ.get('MUJOCO_GL'))") == "[] [] None"


@pytest.mark.parametrize("before", ["", "from dm_control import mujoco; "], ids=["first", "after dm_control"])
def test_renders_without_display(before):
    printed = run(f"{before}from caregiver_mj.house import rendering{RENDER}", DISPLAY=None, WAYLAND_DISPLAY=None)
    assert printed in ("EglContext (48, 64, 3) red", "OSMesaContext (48, 64, 3) red")


def test_plain_dm_control_renders_too():
    code = (
        "from caregiver_mj.house import rendering; from dm_control import mujoco\n"
        f"print(mujoco.Physics.from_xml_string({SCENE!r}).render(48, 64, camera_id='side').shape)"
    )
    assert run(code, DISPLAY=None, WAYLAND_DISPLAY=None) == "(48, 64, 3)"


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


@pytest.mark.parametrize(
    ("wish", "told"),
    [
        ("off", "RenderingError"),
        (
            "nonsense",
            "CaregiverError the environment variable MUJOCO_GL must be one of egl, osmesa, glfw, glx, off, got",
        ),
        ("glfw", "MUJOCO_GL asks for (glfw: there is no display"),
    ],
)
def test_what_cannot_be_had_is_told_in_a_line(wish, told):
    printed = run(
        f"from caregiver_mj.house import rendering{RENDER}", MUJOCO_GL=wish, DISPLAY=None, WAYLAND_DISPLAY=None
    )
    assert told in printed
    assert f"'{wish}'" in printed or f"({wish}: " in printed
    assert "\n" not in printed


@pytest.mark.parametrize("wish", ["glfw", "glx"])
def test_a_window_system_without_a_display_is_told_in_a_line(wish):
    code = f"from caregiver_mj.house import rendering{RENDER}"
    printed = run(code, MUJOCO_GL=wish, DISPLAY=None, WAYLAND_DISPLAY=None)
    assert f"what the environment variable MUJOCO_GL asks for ({wish}: there is no display" in printed
    assert "; unset it to have what works, or install one" in printed
    assert "\n" not in printed


def test_a_model_that_is_too_large_is_told_in_a_line():
    materials = "".join(f"<material name='{i}'/>" for i in range(1001))
    large = RENDER.replace("<mujoco>", f"<mujoco><asset>{materials}</asset>")
    printed = run(f"from caregiver_mj.house import rendering{large}", DISPLAY=None, WAYLAND_DISPLAY=None)
    assert printed.startswith("RenderingError cannot render: the house is too large to be drawn (Maximum number of mat")
    assert printed.endswith("got 1001)")


def test_falls_back_to_osmesa():
    # A machine without EGL: the constructor fails, and the next candidate is asked.
    code = """
from caregiver_mj.house import rendering
def fail(*size): raise OSError("libEGL.so.1: no such file")
class Other:
    def __init__(self, *size): self.size = size
rendering.BACKENDS.update(egl=fail, osmesa=Other)
print(rendering.make_context(64, 48).size)
"""
    assert run(code) == "(64, 48)"


def test_one_line_says_what_to_install(no_egl):
    printed = run(f"from caregiver_mj.house import rendering{RENDER}", LD_LIBRARY_PATH=no_egl)
    assert printed.startswith("RenderingError cannot render: no OpenGL backend works (egl: ")
    assert printed.endswith("install one (Debian: apt-get install libegl1 libgl1-mesa-dri, or libosmesa6)")
    assert "\n" not in printed
