"""A browser without a window, for tests of pages; they are left out where there is none."""

import contextlib
import shutil

import pytest

_OPTIONS = """--headless --no-sandbox --disable-background-networking --disable-component-update
--disable-sync --no-first-run"""

_PATIENCE = 300  # seconds for an answer of the driver


@contextlib.contextmanager
def chromium(profile, *options):
    """Chromium by its driver, with a profile in a folder."""
    program, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not (program and driver):
        pytest.skip("there is no chromium with its chromedriver here: apt-get install chromium chromium-driver")
    webdriver = pytest.importorskip("selenium.webdriver")
    settings = webdriver.ChromeOptions()
    settings.binary_location = program
    for option in [*_OPTIONS.split(), *options, f"--user-data-dir={profile}"]:
        settings.add_argument(option)
    settings.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = webdriver.Chrome(settings, webdriver.ChromeService(driver))
    browser.command_executor.client_config.timeout = _PATIENCE
    try:
        yield browser
    finally:
        browser.quit()
