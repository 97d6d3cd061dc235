"""The viewers: `caregiver-mj view --web` as a process and as a browser shows it, and MuJoCo's own in a window."""

import contextlib
import io
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
import urllib.request

import numpy as np
import pytest
from PIL import Image, ImageGrab

from caregiver_mj import cli
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz.viewers import Session

viser = pytest.importorskip("viser")
web = pytest.importorskip("caregiver_mj.viz.viewers.web")

A_CELL = 50  # pixels, as the page shows one, or more
OPTIONS = """--headless --no-sandbox --disable-background-networking --disable-component-update
--disable-sync --no-first-run --window-size=640,480 --force-device-scale-factor=0.5 --enable-unsafe-swiftshader"""
LONGEST = 300  # seconds for an answer of the driver
PATIENCE = 90  # seconds: without a graphics card a page is drawn once a second, or less on a busy machine


@pytest.fixture
def process(house, request):
    """The command at work, and where it serves."""
    who = getattr(request, "param", "foresight")
    command = [sys.executable, "-m", "caregiver_mj", "view", "--web", "--port", "0", "--house", house]
    options = ["--caregiver", who, "--speed", "5", "--rate", "2", "--plain"]
    with subprocess.Popen([*command, *options], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        first = process.stdout.readline()
        found = re.match(r"http://127\.0\.0\.1:\d+", first)
        assert found, first + process.stderr.read()
        yield process, found[0]
        process.kill()


@contextlib.contextmanager
def chromium(profile):
    """Chromium without a window, by its driver, with a profile in a folder; skips the test where there is none."""
    program, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not (program and driver):
        pytest.skip("there is no chromium with its chromedriver here: apt-get install chromium chromium-driver")
    webdriver = pytest.importorskip("selenium.webdriver")
    settings = webdriver.ChromeOptions()
    settings.binary_location = program
    for option in [*OPTIONS.split(), f"--user-data-dir={profile}"]:
        settings.add_argument(option)
    with webdriver.Chrome(settings, webdriver.ChromeService(driver)) as browser:
        browser.command_executor.client_config.timeout = LONGEST
        yield browser


@pytest.mark.slow
def test_the_page_in_a_browser(process, tmp_path):
    process, url = process
    with chromium(tmp_path) as browser:
        wait_for = Patience(browser)
        browser.set_page_load_timeout(PATIENCE)
        browser.set_script_timeout(PATIENCE)
        browser.get(url)
        wait_for.press("Pause")  # while it plays, the page takes seconds to answer
        wait_for(lambda: wait_for.texts("told") == ["Paused."])
        assert len(wait_for.texts("danger")) == 2  # the stairwell and the candle
        assert wait_for.texts("safe")
        assert wait_for.texts("believed")
        wait_for(lambda: colours(browser) > 500)  # what is empty has a handful
        foreseen = house_in(browser)
        wait_for.tick("Danger foreseen")
        wait_for.press("0.02 s")  # which shows it
        wait_for(lambda: (house_in(browser) != foreseen).any(axis=2).sum() > A_CELL)

        halted = wait_for.number("timestep")
        wait_for.press("1 move")
        wait_for(lambda: wait_for.number("timestep") == halted + 1)
        assert wait_for.texts("told") == ["Paused."]

        assert wait_for.texts("epsilon") == ["0.5"]
        wait_for.enter("Epsilon", "2")
        wait_for.press("Start")
        wait_for(lambda: "epsilon must be in [0, 1]" in "".join(wait_for.texts("told")))
        wait_for.enter("House", "house-3-8x8-rooms1")
        wait_for.enter("Epsilon", "1")
        wait_for.enter("Children", "2")
        wait_for.choose("Caregiver", "paper")
        wait_for.press("Start")
        wait_for(lambda: wait_for.texts("epsilon") == ["1, 1"])
        wait_for(lambda: "--house house-3-8x8-rooms1 --epsilon 1,1 --caregiver paper " in wait_for.text("same"))
        assert len(wait_for.texts("safe")) == 2
        assert not wait_for.texts("believed")  # it does not look ahead

        wait_for.choose("Speed", "20")
        wait_for.press("Play")
        wait_for(lambda: wait_for.number("timestep") > 2)
    process.send_signal(signal.SIGTERM)
    out, err = process.communicate(timeout=PATIENCE)
    assert (process.returncode, out, err.splitlines()[1:]) == (0, "", ["closed"]), err


class Patience:
    """Waits for what a page is to show, and acts on it."""

    def __init__(self, browser):
        self._browser = browser

    def __call__(self, condition):
        from selenium.common import StaleElementReferenceException, TimeoutException
        from selenium.webdriver.support.wait import WebDriverWait

        passing = (StaleElementReferenceException, TimeoutException, IndexError)
        return WebDriverWait(self._browser, PATIENCE, 0.3, passing).until(lambda _: condition())

    def texts(self, kind):
        script = "return [...document.querySelectorAll('.' + arguments[0])].map(e => e.innerText)"
        return self._browser.execute_script(script, kind)

    def text(self, kind):
        return self(lambda: self.texts(kind)[0])

    def number(self, kind):
        return int(self.text(kind))

    def press(self, label):
        self._click("button", label)

    def enter(self, label, value):
        self._field(label).send_keys("\ue009a\ue000", value)  # Ctrl-A first

    def choose(self, label, value):
        """Takes one of what a field offers."""
        self._field(label).click()
        self._click("[role=option]", value)

    def tick(self, label):
        self._browser.execute_script("arguments[0].click()", self._field(label))

    def _click(self, kind, words):
        found = "[...document.querySelectorAll(arguments[0])].find(e => e.innerText.trim() == arguments[1])"
        script = f"const e = {found}; if (e) e.click(); return !!e"
        self(lambda: self._browser.execute_script(script, kind, words))

    def _field(self, label):
        return self(lambda: self._browser.find_element("xpath", f"//label[.='{label}']/following::input[1]"))


def house_in(browser):
    """The left half of the page, where the house is, without what stands above it: a picture (height, width, 3)."""
    picture = np.asarray(Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB"))
    return picture[picture.shape[0] // 2 :, : picture.shape[1] // 2]


def colours(browser):
    """How many colours there are in it."""
    return len(np.unique(house_in(browser).reshape(-1, 3), axis=0))


@pytest.fixture(scope="module")
def viewer(house):
    spec = EpisodeSpec(FloorPlan.load(house), "1,.25", "none", file=house)
    with contextlib.closing(web.WebViewer(Session(spec, playing=False), "127.0.0.1", 0, 20.0)) as viewer:
        yield viewer


def test_it_serves_this_machine_alone_at_a_port_of_its_own(viewer):
    assert viewer.url.startswith("http://127.0.0.1:")
    with urllib.request.urlopen(viewer.url, timeout=10) as page:
        assert b"<html" in page.read()
    # Nobody makes it public.
    assert viewer.server.request_share_url() is None


@pytest.mark.parametrize(
    ("host", "origin", "status"),
    [
        ("127.0.0.1:PORT", "http://127.0.0.1:PORT", 101),
        ("localhost:PORT", "http://localhost:PORT", 101),
        ("localhost:9", "http://localhost:9", 101),  # a tunnel
        ("127.0.0.1:PORT", None, 101),  # no browser
        ("127.0.0.1:PORT", "http://evil.example", 403),
        ("127.0.0.1:PORT", "http://127.0.0.1:9", 403),  # another page of this machine
        ("127.0.0.1:PORT", "null", 403),
        ("evil.example:PORT", "http://evil.example:PORT", 403),  # DNS rebinding
        ("[::1", "http://[::1", 403),
    ],
)
def test_a_page_of_another_site_reads_nothing(viewer, host, origin, status):
    port = str(viewer.server.get_port())
    lines = ["GET / HTTP/1.1", f"Host: {host}", "Upgrade: websocket", "Connection: Upgrade"]
    lines += ["Sec-WebSocket-Version: 13", "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA=="]
    lines += [f"Sec-WebSocket-Protocol: viser-v{viser.__version__}", *([f"Origin: {origin}"] if origin else [])]
    with socket.create_connection(("127.0.0.1", int(port)), timeout=10) as connection:
        connection.sendall("\r\n".join([*lines, "", ""]).replace("PORT", port).encode())
        assert connection.recv(4096).split()[1] == str(status).encode()


def test_a_port_that_is_taken(capsys, house):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert cli.main(["view", "--web", "--house", house, "--caregiver", "none", "--port", port]) == 2
    assert f"port {port}: Address already in use; --port 0 takes any" in capsys.readouterr().err


def test_without_a_display_a_line_says_what_there_is(capsys, monkeypatch, house):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    assert cli.main(["view", "--house", house]) == 1
    assert capsys.readouterr().err == (
        "caregiver-mj: no display for a window: use `caregiver-mj view --web` and a browser\n"
    )


SIZE = "640x480x24"  # of the display


@pytest.fixture
def display():
    """A display that nobody sees."""
    program = shutil.which("Xvfb")
    if not program:
        pytest.skip("there is no Xvfb here: apt-get install xvfb")
    read, write = os.pipe()
    command = [program, "-displayfd", str(write), "-screen", "0", SIZE]
    with subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL) as server:
        os.close(write)
        with os.fdopen(read) as number:
            name = number.readline().strip()
        yield f":{name}"
        server.terminate()


def test_the_window(display, house):
    command = [sys.executable, "-m", "caregiver_mj", "view", "--house", house, "--caregiver", "none"]
    environment = os.environ | {"DISPLAY": display}
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end and process.poll() is None and colours_of(display) < 500:
            time.sleep(0.5)
        seen = colours_of(display)
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=PATIENCE)
    if "GLX" in err or "GL context" in err:
        pytest.skip(f"the display has no OpenGL: {err}")
    assert seen >= 500
    assert (process.returncode, out) == (0, "")
    prepares = f"preparing house {house}, children 0.5, caregiver none, for a window ..."
    assert err.splitlines() == [prepares, "closed"]


def colours_of(display):
    """How many colours the display shows."""
    picture = np.asarray(ImageGrab.grab(xdisplay=display).convert("RGB"))
    return len(np.unique(picture.reshape(-1, 3), axis=0))
