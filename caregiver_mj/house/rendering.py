"""Offscreen rendering without a display: EGL, then OSMesa, chosen at the first frame and never at import.

dm_control chooses its OpenGL backend at import, with a preference for GLFW, which needs a display. This module imports
it with rendering switched off, and starts a backend at the first frame; the package imports dm_control only from here.
The environment variable `MUJOCO_GL` takes precedence.

The contexts call the libraries through ctypes. dm_control's own use PyOpenGL, which binds to one library for good at
its first import, without a way back from EGL to OSMesa, and needs a libGL, which EGL alone does not include. macOS and
Windows have neither library; GLFW is the default there.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import importlib.metadata
import os
import sys
import warnings
from collections.abc import Callable
from typing import Any

from caregiver_mj.errors import CaregiverError, MissingExtraError, RenderingError
from caregiver_mj.registry import environment

_MUJOCO_GL = "MUJOCO_GL"
_OFF = ("off", "disable", "disabled", "false", "0")  # MuJoCo's words for no rendering
_ON = ("on", "enable", "enabled", "true", "1")  # MuJoCo's words for any
_ADVICE = "install one (Debian: apt-get install libegl1 libgl1-mesa-dri, or libosmesa6)"

# dm_control cannot build a Physics on MuJoCo 4, which cannot even be imported if it was installed over MuJoCo 3.
_INSTALLED = importlib.metadata.version("mujoco")
if int(_INSTALLED.partition(".")[0]) >= 4:
    raise MissingExtraError(f"the house requires MuJoCo below 4, got {_INSTALLED}: pip install 'mujoco<4'")
try:
    import mujoco
except Exception:  # with MUJOCO_GL set it starts OpenGL at import, and can fail in any way
    with environment(_MUJOCO_GL, "off"):
        import mujoco
try:
    with environment(_MUJOCO_GL, "off"):  # keeps imported libraries from starting OpenGL
        from dm_control import _render
        from dm_control._render import base, executor
        from dm_control.mujoco import engine, wrapper
        from dm_control.rl import control
        from dm_control.utils import rewards
except ModuleNotFoundError as error:  # as after `pip install caregiver_mj` on Python 3.13: see pyproject.toml
    if error.name != "dm_control":
        raise
    raise MissingExtraError("the house requires dm_control: pip install --no-deps dm_control==1.0.50") from None

__all__ = ["OffscreenRendering", "control", "engine", "make_context", "mujoco", "rewards", "wrapper"]


class _Egl:
    """libEGL, with a display that needs no screen."""

    # From EGL/egl.h and EGL/eglext.h.
    PLATFORM_DEVICE = 0x313F
    OPENGL_API = 0x30A2
    CONFIG = (
        0x3033, 0x0001,  # EGL_SURFACE_TYPE: EGL_PBUFFER_BIT
        0x3040, 0x0008,  # EGL_RENDERABLE_TYPE: EGL_OPENGL_BIT
        0x3024, 8, 0x3023, 8, 0x3022, 8, 0x3021, 8,  # EGL_RED, GREEN, BLUE, ALPHA_SIZE
        0x3025, 24, 0x3026, 8,  # EGL_DEPTH_SIZE, EGL_STENCIL_SIZE
        0x3038,  # EGL_NONE
    )  # fmt: skip
    MAX_DEVICES = 16

    def __init__(self) -> None:
        library = ctypes.CDLL("libEGL.so.1", mode=ctypes.RTLD_GLOBAL)  # where libmujoco looks for it
        pointer, integer = ctypes.c_void_p, ctypes.c_int

        def function(name: str, result: type[Any], *arguments: type[Any]) -> Callable[..., Any]:
            address = ctypes.CFUNCTYPE(pointer, ctypes.c_char_p)(("eglGetProcAddress", library))(name.encode())
            if not address:
                raise RuntimeError(f"libEGL has no {name}")
            return ctypes.CFUNCTYPE(result, *arguments)(address)

        query_devices = function("eglQueryDevicesEXT", integer, integer, pointer, pointer)
        get_display = function("eglGetPlatformDisplayEXT", pointer, integer, pointer, pointer)
        initialize = function("eglInitialize", integer, pointer, pointer, pointer)
        self.bind_api = function("eglBindAPI", integer, integer)
        self.choose_config = function("eglChooseConfig", integer, pointer, pointer, pointer, integer, pointer)
        self.create_context = function("eglCreateContext", pointer, pointer, pointer, pointer, pointer)
        self.make_current = function("eglMakeCurrent", integer, pointer, pointer, pointer, pointer)
        self.destroy_context = function("eglDestroyContext", integer, pointer, pointer)

        devices, count = (pointer * self.MAX_DEVICES)(), integer()
        query_devices(self.MAX_DEVICES, devices, ctypes.byref(count))
        found = devices[: count.value]
        if wish := os.environ.get("MUJOCO_EGL_DEVICE_ID"):
            found = found[int(wish) : int(wish) + 1]
        for device in found:
            self.display = get_display(self.PLATFORM_DEVICE, device, None)
            if self.display and initialize(self.display, None, None):
                return
        raise RuntimeError(f"none of {len(found)} EGL devices can be used")


_egl = functools.cache(_Egl)  # started at first use


class _Context(base.ContextBase):
    """An OpenGL context of a library called through ctypes."""

    def __init__(self, max_width: int, max_height: int):
        self._context = None
        self._patients: list[Any] = []  # the base class's destructor reads it even after a failed construction
        super().__init__(max_width, max_height, executor.PassthroughRenderExecutor)


class EglContext(_Context):
    """An OpenGL context by EGL."""

    def _platform_init(self, max_width: int, max_height: int) -> None:
        egl = _egl()
        config, count = ctypes.c_void_p(), ctypes.c_int()
        wanted = (ctypes.c_int * len(egl.CONFIG))(*egl.CONFIG)
        egl.bind_api(egl.OPENGL_API)
        egl.choose_config(egl.display, wanted, ctypes.byref(config), 1, ctypes.byref(count))
        self._context = egl.create_context(egl.display, config, None, None) if count.value else None
        if not self._context:
            raise RuntimeError("EGL makes no OpenGL context")

    def _platform_make_current(self) -> None:
        if self._context and not _egl().make_current(_egl().display, None, None, self._context):
            raise RuntimeError("EGL cannot make its OpenGL context current")

    def _platform_free(self) -> None:
        if self._context:
            egl = _egl()
            egl.make_current(egl.display, None, None, None)
            egl.destroy_context(egl.display, self._context)
            self._context = None


@functools.cache
def _osmesa() -> ctypes.CDLL:
    names = ("libOSMesa.so.8", "libOSMesa.so.6")
    for name in names:
        with contextlib.suppress(OSError):
            library = ctypes.CDLL(name, mode=ctypes.RTLD_GLOBAL)
            library.OSMesaCreateContextExt.restype = ctypes.c_void_p
            return library
    raise RuntimeError(f"neither {' nor '.join(names)} can be loaded")


class OSMesaContext(_Context):
    """An OpenGL context by OSMesa, which renders into our memory."""

    _RGBA, _UNSIGNED_BYTE = 0x1908, 0x1401  # GL_RGBA, GL_UNSIGNED_BYTE

    def _platform_init(self, max_width: int, max_height: int) -> None:
        create = _osmesa().OSMesaCreateContextExt
        self._context = create(self._RGBA, 24, 8, 0, None)  # bits of depth, stencil, accumulation
        if not self._context:
            raise RuntimeError("OSMesa makes no OpenGL context")
        self._size = max_width, max_height
        self._buffer = (ctypes.c_ubyte * (4 * max_width * max_height))()
        os.environ[_MUJOCO_GL] = "osmesa"  # libmujoco's source of OpenGL functions

    def _platform_make_current(self) -> None:
        if self._context and not _osmesa().OSMesaMakeCurrent(
            ctypes.c_void_p(self._context), self._buffer, self._UNSIGNED_BYTE, *self._size
        ):
            raise RuntimeError("OSMesa cannot make its OpenGL context current")

    def _platform_free(self) -> None:
        if self._context:
            _osmesa().OSMesaDestroyContext(ctypes.c_void_p(self._context))
            self._context = None


def _glfw_context(max_width: int, max_height: int) -> base.ContextBase:
    import glfw

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # glfw's, in two lines
        if not glfw.init():
            raise RuntimeError("there is no display that it can connect to")
        from dm_control._render import glfw_renderer  # connects to the display

    return glfw_renderer.GLFWContext(max_width, max_height)


# In order of preference. Mesa 25.1 dropped OSMesa; GLFW needs a display: on Linux only the user can choose it.
BACKENDS: dict[str, Callable[[int, int], base.ContextBase]] = {"egl": EglContext, "osmesa": OSMesaContext}
if sys.platform in ("darwin", "win32"):
    BACKENDS = {"glfw": _glfw_context}
_BY_WISH_ONLY = {"glfw": _glfw_context, "glx": _glfw_context}


def make_context(max_width: int, max_height: int) -> base.ContextBase:
    """Make an OpenGL context with the first backend that works; replaces `dm_control._render.Renderer`.

    Its offscreen buffer has a width and a height in pixels.

    Raises:
        RenderingError: No backend works, or not the one in `MUJOCO_GL`.
        CaregiverError: `MUJOCO_GL` is unknown.
    """
    wish = os.environ.get(_MUJOCO_GL, "").strip().lower()
    if wish in _OFF:
        raise RenderingError(f"cannot render: the environment variable {_MUJOCO_GL} is '{wish}', which forbids it")
    known = BACKENDS | _BY_WISH_ONLY
    if not wish or wish in _ON:
        candidates = BACKENDS
    elif wish in known:
        candidates = {wish: known[wish]}
    else:
        words = ", ".join([*known, _OFF[0]])
        raise CaregiverError(f"the environment variable {_MUJOCO_GL} must be one of {words}, got '{wish}'")
    failures = []
    for name, context in candidates.items():
        try:
            return context(max_width, max_height)
        except Exception as error:  # any failure of the system's libraries
            failures.append(f"{name}: {error}")
    if wish in known:
        raise RenderingError(
            f"cannot render with what the environment variable {_MUJOCO_GL} asks for ({'; '.join(failures)}); "
            f"unset it to have what works, or {_ADVICE}"
        )
    raise RenderingError(f"cannot render: no OpenGL backend works ({'; '.join(failures)}); {_ADVICE}")


class OffscreenRendering:
    """Mixin for a dm_control `Physics` that renders with `make_context`, even if dm_control was imported before."""

    model: Any  # dm_control's wrapper
    _contexts: Any
    _free_rendering_contexts: Callable[[], None]

    def fit_pictures(self, width: int, height: int) -> None:
        """Enlarge the offscreen buffer for pictures of a size, pixels, if needed, and apply the model's `vis`."""
        size = self.model.vis.global_
        size.offwidth, size.offheight = max(size.offwidth, width), max(size.offheight, height)
        if self._contexts:  # for earlier pictures, such as a policy's
            self._free_rendering_contexts()

    def _make_rendering_contexts(self) -> None:
        class Renderer(wrapper.MjrContext):
            _ptr = staticmethod(lambda: None)  # the destructor reads it even after a failed construction

        size = self.model.vis.global_
        context = make_context(size.offwidth, size.offheight)
        try:
            renderer = Renderer(self.model, context)
        except mujoco.FatalError as error:
            if "maximum number" in str(error).lower():  # of materials or textures, not a matter of OpenGL
                raise RenderingError(f"cannot render: the house is too large to be drawn ({error})") from None
            raise RenderingError(f"cannot render: {error}; {_ADVICE}") from None
        self._contexts = engine.Contexts(gl=context, mujoco=renderer)


if _render.BACKEND in _OFF:  # else dm_control was imported earlier, and has a backend
    _render.Renderer = make_context
