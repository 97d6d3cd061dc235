"""The report as a browser shows it, on a phone and on a laptop."""

import imageio_ffmpeg
import numpy as np
import pytest
from browsers import chromium
from made_runs import FAMILIES, drawn_once, write_run

from caregiver_mj.viz import figures, report


@pytest.fixture(scope="module", params=[None, FAMILIES], ids=["single", "several"])
def folder(request, tmp_path_factory):
    """A folder with a run of each world and a film, and the report of both."""
    folder = tmp_path_factory.mktemp("report")
    write_run(folder / "grid", families=request.param)
    write_run(folder / "house", "house", caregivers=("none", "paper"), families=request.param)
    film = imageio_ffmpeg.write_frames(str(folder / "grid" / "film.mp4"), (64, 48), fps=10)
    film.send(None)
    for shade in range(20):
        film.send(np.full((48, 64, 3), 10 * shade, np.uint8))
    film.close()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "as_bytes", drawn_once)
        report.write_report([folder / "grid", folder / "house"])
    return folder / "grid"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with chromium(tmp_path_factory.mktemp("profile"), "--disable-gpu") as browser:
        yield browser


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 1280])
def test_page_in_a_browser(folder, browser, width):
    screen = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": width < 500}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    browser.get((folder / "report.html").as_uri())
    if width < 500:  # what is secondary is folded
        assert browser.execute_script("return document.documentElement.scrollHeight") < 9000
    browser.set_script_timeout(20)
    browser.execute_async_script(
        """const done = arguments[0], film = document.querySelector("video");
        document.querySelectorAll("details").forEach(part => part.open = true);
        film.readyState ? done() : film.onloadedmetadata = film.onerror = () => done();"""
    )
    sizes = browser.execute_script("return [...document.images].map(i => [i.naturalWidth, i.clientWidth])")
    assert len(sizes) == 23
    assert np.min(sizes) > 200
    assert browser.execute_script("return document.querySelector('video').videoWidth") == 64
    fetched = browser.execute_script("return performance.getEntriesByType('resource').map(r => r.name)")
    assert all(name.startswith("data:") for name in fetched)
    assert browser.get_log("browser") == []
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    wide = """return [...document.querySelectorAll("body *")].filter(e => {
        if (e.closest(".scroll")) return false;
        const box = e.getBoundingClientRect();
        return box.right > innerWidth + 0.5 || box.left < -0.5 || e.scrollWidth > e.clientWidth + 1 && e.clientWidth;
    }).map(e => e.outerHTML.slice(0, 200))"""
    assert browser.execute_script(wide) == []
    # What is too wide scrolls in its box, which is no wider than the page.
    boxes = browser.execute_script("return [...document.querySelectorAll('.scroll')].map(e => e.clientWidth)")
    assert len(boxes) > 10
    assert min(boxes) > 0
    assert max(boxes) <= width
