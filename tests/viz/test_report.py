"""The report: its numbers worked out by hand, its files, and the page as a browser shows it."""

import re
import shutil

import imageio_ffmpeg
import numpy as np
import pandas as pd
import pytest
from test_cli import fails

from caregiver_mj import cli
from caregiver_mj.experiments import evaluation
from caregiver_mj.experiments.evaluation import Settings
from caregiver_mj.experiments.run_folder import RunFolder
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import figures, report

PLAN = FloorPlan.parse("######\n#B.S.#\n#....#\n#C..T#\n######", "tiny")
EPISODES = 8
DAMAGE = {  # caregiver, epsilon: an episode each
    ("none", 1.0): [40, 50, 60, 40, 50, 60, 50, 50],
    ("paper", 1.0): [10, 10, 40, 10, 10, 20, 10, 10],
    ("guard", 1.0): [40, 49, 59, 39, 49, 59, 49, 49],
    ("none", 0.25): [20, 20, 10, 20, 20, 10, 0, 0],
    ("paper", 0.25): [5, 10, 5, 5, 5, 10, 0, 0],
    ("guard", 0.25): [5, 10, 5, 5, 5, 10, 0, 0],
}


def write_run(folder, world="grid", plan=PLAN, caregivers=("none", "paper", "guard"), mark=0):
    """A finished run whose numbers are known."""
    settings = Settings(plan, world, caregivers, (1.0, 0.25), EPISODES, seed=7)
    rows = []
    for (caregiver, epsilon), damages in DAMAGE.items():
        for episode, damage in enumerate(damages if caregiver in caregivers else ()):
            row = {"world": world, "house": plan.name, "caregiver": caregiver, "epsilon": epsilon}
            row |= {"episode": episode, "seed": 100 + episode, **dict.fromkeys(evaluation.MEASURES, 0)}
            row |= {"damage": float(damage), "damage_table": float(damage), "timesteps_to_threshold": 200 - 2 * damage}
            row |= {"cells_visited": 5 + episode % 2, "toys_reached": 3, "moves_blocked": 2, "interventions_done": 4}
            row |= {"strikes": mark, "sim_seconds": 337.5, "wall_seconds": 1.0}
            rows.append(row)
    episodes = pd.DataFrame(rows)
    cells = pd.DataFrame(plan.free_cells, columns=["row", "column"])
    maps = []
    for (caregiver, epsilon), damages in DAMAGE.items():
        key = {"world": world, "house": plan.name, "caregiver": caregiver, "epsilon": epsilon}
        maps.append(cells.assign(visits=200.0 * EPISODES / len(cells), damage=sum(damages) / len(cells), **key))
    run = RunFolder(folder, settings.record())
    run.finish(episodes, evaluation.summarise(settings, episodes), pd.concat(maps))
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a run of each world and a film, and the report of both."""
    folder = tmp_path_factory.mktemp("report")
    write_run(folder / "grid")
    write_run(folder / "house", "house", caregivers=("none", "paper"), mark=3)
    film = imageio_ffmpeg.write_frames(str(folder / "grid" / "film.mp4"), (64, 48), fps=10)
    film.send(None)
    for shade in range(20):
        film.send(np.full((48, 64, 3), 10 * shade, np.uint8))
    film.close()
    assert cli.main(["report", str(folder / "grid"), str(folder / "house")]) == 0
    return folder / "grid"


@pytest.fixture(scope="module")
def page(folder):
    return (folder / "report.html").read_text("utf-8")


def words(page):
    """The page's text, without its markup and with single spaces."""
    text = re.sub(r"<style>.*?</style>|<[^>]+>", " ", page, flags=re.DOTALL)
    return " ".join(text.replace("&lt;", "<").replace("&#39;", "'").split())


# -- Numbers -----------------------------------------------------------------------------------------


def test_headline(page):
    # Without: 400 + 100; with: 120 + 40, over the same novices.
    assert "68 % of the damage avoided" in words(page)
    # In the paper: 1 - (0.2291 + 0.0466) / (0.7346 + 0.1887) = 0.701
    assert "In the paper, the same novices together: 70 %." in words(page)
    assert "damage without 31.2 with caregiver 10.0" in words(page)  # 500 / 16 and 160 / 16
    assert "timesteps until 15 damage 137.5 180.0" in words(page)  # 200 - 2 * damage
    assert "toys reached in 200 timesteps 3.0 3.0" in words(page)
    assert "In all its 16 episodes together, it strikes the child 48 times" in words(page)  # in the house, 3 in each
    assert words(page).count("it strikes") == 1  # not in the grid
    assert "So few make too narrow an interval" in words(page)


def test_headline_interval_is_that_of_paired_episodes(tmp_path):
    # Half of the damage is left in every episode, though episodes differ: there is no doubt about the share.
    write_run(tmp_path)
    episodes = pd.read_parquet(tmp_path / "episodes.parquet")
    alone = episodes[episodes.caregiver == "none"].set_index(["epsilon", "episode"]).damage
    guarded = episodes.caregiver == "paper"
    keys = list(zip(episodes.epsilon[guarded], episodes.episode[guarded], strict=True))
    episodes.loc[guarded, "damage"] = (0.5 * alone[keys]).to_numpy()
    episodes.to_parquet(tmp_path / "episodes.parquet")
    told = report.headline(report.read_run(tmp_path))
    assert (told["avoided"], told["interval"]) == ("50 %", "50.0 to 50.0 %")


def test_tables_stand_beside_the_published_ones(folder, page):
    tables = (folder / "tables.md").read_text("utf-8")
    # Means over the greatest damage, 60: 50 / 60 = 0.833, 15 / 60 = 0.250, and 15 / 50 = 0.30 of it left.
    row = next(line for line in tables.splitlines() if line.startswith("| random motion | 0.833"))
    cells = [cell.split(" [")[0] for cell in row.strip("| ").split(" | ")]
    assert cells == ["random motion", "0.833", "0.735", "0.250", "0.229", "0.30", "0.31"]
    row = next(line for line in tables.splitlines() if line.startswith("| random motion | 100.0"))
    cells = [cell.split(" [")[0] for cell in row.strip("| ").split(" | ")]
    assert cells == ["random motion", "100.0", "35.5", "170.0", "97.0"]
    for row in ("random motion 0.833 [", "] 0.735 0.250 [", "] 0.229 0.30 [", "] 35.5 170.0 ["):
        assert row in words(page)


def test_statistics(page):
    # Damage falls by 35 on average; all eight differences of one sign: p = 2 / 2**8 = 0.008.
    row = words(page).split("Differences that the caregiver makes — Grid (tiny)")[1].split("random motion")[1]
    assert row.startswith(" −35.0 [")
    assert "] p = 0.008 +70.0 [" in row
    assert "0.0 [0.0, 0.0] p = 1.00 25 % random" in row  # as many toys


def test_a_caregiver_that_is_not_beaten_is_named(folder):
    run = report.read_run(folder)
    ((wins, text),) = report.verdicts(run)
    assert not wins
    assert text.startswith("Does not beat guard with 1 of 2 novices.")
    assert text.endswith(" 25 % random 0.00 [0.00, 0.00], p = 1.00.")


def test_a_caregiver_that_is_beaten(folder):
    run = report.read_run(folder)
    row = run.comparison("paper", "guard", 0.25)
    row.update(damage_difference_mean=-1.0, damage_p=0.0001)
    assert report.verdicts(run) == [(True, "Beats guard with every novice: less damage, p < 0.01 each.")]
    row.update(damage_difference_mean=1.0, damage_difference_ci_low=0.5, damage_difference_ci_high=1.5)
    ((wins, text),) = report.verdicts(run)
    assert not wins
    assert "more damage: 25 % random +1.00 [+0.50, +1.50], p < 0.001" in text


def test_worlds_side_by_side(page):
    text = words(page).split("Damage left, grid (tiny) beside physical house (tiny)")[1]
    assert re.search(r"random motion 0\.30 \[\S+ \S+\] 0\.30 \[\S+ \S+\] 0\.31 0 %", text)


def test_maps_are_means_of_an_episode_on_one_scale(tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(figures, "heat_map", lambda plan, values, scale, top, quantity: drawn.append((values, top)))
    monkeypatch.setattr(figures, "as_bytes", lambda figure, kind: b"")
    report.write_report([write_run(tmp_path)])
    (visits, most), (guarded_visits, _), (damage, worst), (guarded_damage, same) = drawn
    cells = len(PLAN.free_cells)
    assert visits.sum() == guarded_visits.sum() == pytest.approx(200)
    assert most == pytest.approx(200 / cells)
    assert damage.sum() == pytest.approx(500 / 16)
    assert guarded_damage.sum() == pytest.approx(160 / 16)
    assert worst == same == pytest.approx(500 / 16 / cells)


def test_command_gives_the_same_rows(tmp_path, capsys):
    command = ["evaluate", "--world", "grid", "--house", "paper", "--caregiver", "none", "guard"]
    command += ["--epsilon", "0.5", "--episodes", "3", "--seed", "5"]
    assert cli.main([*command, "--out", str(tmp_path)]) == 0
    assert report.read_run(tmp_path).command() == " ".join(["caregiver-mj", *command])
    assert cli.main(["report", str(tmp_path)]) == 0  # of `guard`, for there is no `paper`
    assert "caregiver <code>guard</code>" in (tmp_path / "report.html").read_text("utf-8")


def test_no_damage_at_all(tmp_path):
    command = ["evaluate", "--world", "grid", "--epsilon", "0", "--episodes", "1", "--out", str(tmp_path)]
    assert cli.main(command) == 0
    assert cli.main(["report", str(tmp_path)]) == 0
    text = words((tmp_path / "report.html").read_text("utf-8"))
    assert "0 damage, without the caregiver too" in text
    assert "nan" not in text


def test_numbers_have_a_true_minus():
    assert report._number(-1.25) == "−1.2"
    assert report._number(-0.01) == "0.0"
    assert report._number(0.01, 1, "+") == "0.0"
    assert report._number(2.0, 1, "+") == "+2.0"


# -- Files -------------------------------------------------------------------------------------------


def test_figures_are_there_in_both_forms(folder):
    names = {"damage_left"}
    for world in ("grid_tiny", "house_tiny"):
        names |= {f"{name}_{world}" for name in ("figure_2", "figure_3", "figure_4", "damage_left")}
        names |= {f"map_{what}_{who}_{world}" for what in ("visits", "damage") for who in ("with", "without")}
    assert {path.name for path in (folder / "figures").iterdir()} == {
        f"{n}.{kind}" for n in names for kind in ("svg", "png")
    }
    for name in names:
        assert (folder / "figures" / f"{name}.png").read_bytes().startswith(b"\x89PNG")
        assert b"</svg>" in (folder / "figures" / f"{name}.svg").read_bytes()


def test_page_is_self_contained(page):
    links = re.findall(r"""(?:src|href|srcset|poster|data)\s*=\s*["']([^"']*)""", page)
    assert len(links) > 15
    assert {link.split(":")[0] if ":" in link else link[0] for link in links} == {"data", "#"}
    assert "url(" not in page
    assert "@import" not in page
    assert "<script" not in page


def test_the_same_report_again(folder, page):
    again = report.write_report([folder, folder.parent / "house"])
    assert again.read_text("utf-8") == page


def test_refused(tmp_path, capsys):
    assert "holds no run" in fails(capsys, ["report", tmp_path / "nothing"])
    assert "holds no run" in fails(capsys, ["report", tmp_path])
    settings = Settings(PLAN, "grid", ("none", "paper"), (1.0,), 2)
    RunFolder(tmp_path / "begun", settings.record())
    assert "is not finished" in fails(capsys, ["report", tmp_path / "begun"])
    whole = write_run(tmp_path / "whole")
    assert "same world and house" in fails(capsys, ["report", whole, whole])
    assert "compares `none`" in fails(capsys, ["report", write_run(tmp_path / "alone", caregivers=("none",))])
    assert "no such file" in fails(capsys, ["report", whole, "--video", tmp_path / "no.mp4"]).lower()
    assert "not a film" in fails(capsys, ["report", whole, "--video", whole / "summary.json"])
    (whole / "maps.parquet").write_bytes(b"PAR1")
    assert "cannot be read" in fails(capsys, ["report", whole])
    (whole / "maps.parquet").unlink()
    assert "maps.parquet" in fails(capsys, ["report", whole])


def test_larger_film_is_refused(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(report, "_LARGEST_FILM", 0.001)
    film = tmp_path / "film.mp4"
    film.write_bytes(b"\0\0\0\x18ftypisom" + bytes(2000))
    assert "too large a page" in fails(capsys, ["report", write_run(tmp_path / "run"), "--video", film])


# -- In a browser ------------------------------------------------------------------------------------

_OPTIONS = """--headless --no-sandbox --disable-gpu --disable-background-networking --disable-component-update
--disable-sync --no-first-run"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    chromium, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not (chromium and driver):
        pytest.skip("there is no chromium with its chromedriver here: apt-get install chromium chromium-driver")
    webdriver = pytest.importorskip("selenium.webdriver")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for option in [*_OPTIONS.split(), f"--user-data-dir={tmp_path_factory.mktemp('profile')}"]:
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    browser = webdriver.Chrome(options, webdriver.ChromeService(driver))
    yield browser
    browser.quit()


@pytest.mark.parametrize("width", [390, 1280])
def test_page_in_a_browser(folder, browser, width):
    screen = {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": width < 500}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", screen)
    browser.get((folder / "report.html").as_uri())
    browser.set_script_timeout(20)
    browser.execute_async_script(
        """const done = arguments[0], film = document.querySelector("video");
        document.querySelectorAll("details").forEach(part => part.open = true);
        film.readyState ? done() : film.onloadedmetadata = film.onerror = () => done();"""
    )
    sizes = browser.execute_script("return [...document.images].map(i => [i.naturalWidth, i.clientWidth])")
    assert len(sizes) == 17
    assert np.min(sizes) > 200
    assert browser.execute_script("return document.querySelector('video').videoWidth") == 64
    fetched = browser.execute_script("return performance.getEntriesByType('resource').map(r => r.name)")
    assert all(name.startswith("data:") for name in fetched)
    assert browser.get_log("browser") == []
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    wide = """return [...document.querySelectorAll("body *")].filter(e => {
        const box = e.getBoundingClientRect();
        return box.right > innerWidth + 0.5 || box.left < -0.5 || e.scrollWidth > e.clientWidth + 1 && e.clientWidth;
    }).map(e => e.outerHTML.slice(0, 200))"""
    assert browser.execute_script(wide) == []


def test_links_lead_somewhere(page):
    targets = set(re.findall(r'href="#([a-z]+)"', page))
    assert len(targets) >= 7
    assert targets <= set(re.findall(r'id="([a-z]+)"', page))


def test_published_numbers():
    # Worked out by hand from the text of the paper's tables: sums of the columns.
    damage, timesteps = (np.sum(list(report.PUBLISHED[c].values()), axis=0) for c in report.PUBLISHED)
    assert damage == pytest.approx([1.7939, 0.5373])
    assert timesteps == pytest.approx([469.5, 832.75])
    assert list(report.PUBLISHED["damage_normalised"]) == list(evaluation.EPSILONS)
