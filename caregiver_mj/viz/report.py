"""The report of one or more finished runs: one page for people, tables in Markdown, and figures."""

from __future__ import annotations

import base64
import dataclasses
import importlib.resources
import json
import os
import pathlib
import shlex
from collections.abc import Sequence
from typing import Any

import jinja2
import numpy as np
import pandas as pd

from caregiver_mj.children.novice import DAMAGE_THRESHOLD, EPISODE_TIMESTEPS
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments import statistics
from caregiver_mj.experiments.run_folder import StorageError
from caregiver_mj.plans import floor_plan
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import colours, figures
from caregiver_mj.viz.colours import Colour
from caregiver_mj.viz.figures import Series

PAPER = 'Rosman, Hayes and Scassellati, "Enhancing Agent Safety through Autonomous Environment Adaptation", 2015'
# Its Tables I and II: means of 20 episodes without and with the caregiver, by the share of the novice's moves that are
# random. Damage is normalised by the greatest of any episode.
PUBLISHED = {
    "damage_normalised": {
        1.0: (0.7346, 0.2291),
        0.75: (0.5295, 0.1438),
        0.5: (0.2846, 0.1106),
        0.25: (0.1887, 0.0466),
        0.05: (0.0565, 0.0072),
    },
    "timesteps_to_threshold": {
        1.0: (35.50, 97.05),
        0.75: (41.05, 164.20),
        0.5: (89.50, 171.50),
        0.25: (107.70, 200.00),
        0.05: (195.75, 200.00),
    },
}

SIGNIFICANT = 0.01  # p below which one caregiver is said to beat another
FILM = {"epsilon": 0.5, "seconds": 15.0, "width": 960, "height": 540}  # of the house, if one is to be made
_LARGEST_FILM = 40  # MB, for it becomes part of the page

FEW = 10  # episodes, of which a bootstrap makes too narrow an interval
_WHERE = ("here", "published")
_WORLDS = {"grid": "Grid", "house": "Physical house"}
_COMPARED = {  # columns of `statistics.COMPARED`, and what to call them
    "damage": "damage",
    "timesteps_to_threshold": "timesteps",
    "cells_visited": "cells visited",
    "toys_reached": "toys reached",
}
_MEASURES = {
    "damage": "damage",
    "damage_stairwell": "by stairs",
    "damage_candle": "by candles",
    "damage_table": "by tables",
    "timesteps_to_threshold": "timesteps",
    "cells_visited": "cells",
    "toys_reached": "toys",
    "moves_blocked": "blocked",
    "interventions": "begun",
    "interventions_done": "done",
    "candles_dropped": "dropped",
    "strikes": "strikes",
}


@dataclasses.dataclass(frozen=True)
class Run:
    """A finished run, as read from its folder.

    Attributes:
        settings: The content of run.json.
        plan: The house.
        episodes: A row an episode.
        summary: What matters of the content of summary.json.
        maps: A row for each caregiver, novice and free cell.
        caregiver: The caregiver that the report is about: `paper` if it ran.
    """

    settings: dict[str, Any]
    plan: FloorPlan
    episodes: pd.DataFrame
    summary: dict[str, Any]
    maps: pd.DataFrame
    caregiver: str

    @property
    def name(self) -> str:
        """Tells the run from others, in file names."""
        world, house = self.settings["world"], self.plan.name
        return world if house == "paper" else f"{world}_{house}"

    @property
    def title(self) -> str:
        world = _WORLDS[self.settings["world"]]
        return world if self.plan.name == "paper" else f"{world} ({self.plan.name})"

    @property
    def novices(self) -> tuple[float, ...]:
        return tuple(self.settings["epsilons"])

    @property
    def baselines(self) -> tuple[str, ...]:
        """The other caregivers that do something."""
        return tuple(c for c in self.settings["caregivers"] if c not in ("none", self.caregiver))

    def row(self, caregiver: str, epsilon: float) -> dict[str, Any]:
        """The summary's row of a caregiver and a novice."""
        return next(r for r in self.summary["rows"] if (r["caregiver"], r["epsilon"]) == (caregiver, epsilon))

    def comparison(self, caregiver: str, baseline: str, epsilon: float) -> dict[str, Any] | None:
        """The summary's comparison of two caregivers with a novice, if it has one."""
        wanted = (caregiver, baseline, epsilon)
        rows = self.summary["comparisons"]
        return next((r for r in rows if (r["caregiver"], r["baseline"], r["epsilon"]) == wanted), None)

    def mean(self, caregiver: str, column: str) -> float:
        """Mean over all episodes of all novices."""
        return float(self.episodes.loc[self.episodes.caregiver == caregiver, column].mean())

    def command(self) -> str:
        """The command that gives the same rows again."""
        settings = self.settings
        house = self.plan.name
        if house not in floor_plan.house_names() or FloorPlan.load(house).rows != self.plan.rows:
            house += ".txt"
        words = ["caregiver-mj", "evaluate", "--world", settings["world"], "--house", house]
        words += ["--caregiver", *settings["caregivers"], "--epsilon", *(f"{e:g}" for e in self.novices)]
        return shlex.join([*words, "--episodes", str(settings["episodes"]), "--seed", str(settings["seed"])])


@dataclasses.dataclass(frozen=True)
class Table:
    """A table of text; the first column names the rows."""

    title: str
    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    note: str = ""

    def markdown(self) -> str:
        lines = [f"### {self.title}", "", " | ".join(self.columns), " | ".join(["---"] * len(self.columns))]
        lines += [" | ".join(row).replace("\n", " ") for row in self.rows]
        lines[2:] = [f"| {line} |" for line in lines[2:]]
        return "\n".join([*lines, "", self.note, ""] if self.note else [*lines, ""])


@dataclasses.dataclass(frozen=True)
class Picture:
    """A figure: the name of its files, and what to say about it."""

    name: str
    svg: bytes
    png: bytes
    caption: str

    @property
    def data(self) -> str:
        return f"data:image/svg+xml;base64,{base64.b64encode(self.svg).decode()}"


def read_run(folder: str | os.PathLike[str]) -> Run:
    """Reads a finished run.

    Raises:
        CaregiverError: There is none in the folder, or none that a report can be made of.
    """
    path = pathlib.Path(folder)
    if not (path / "run.json").is_file():
        raise CaregiverError(f"'{folder}' holds no run: `caregiver-mj evaluate --out DIR` makes one")
    if not (path / "summary.json").is_file():
        raise CaregiverError(f"the run in '{folder}' is not finished: go on with `caregiver-mj evaluate --resume`")
    if not (path / "maps.parquet").is_file():
        raise CaregiverError(f"the run in '{folder}' has no maps.parquet, as runs of an older version: run it again")
    try:
        settings = json.loads((path / "run.json").read_text("utf-8"))
        plan = FloorPlan.parse("\n".join(settings["plan"]), settings["house"], settings["cell_size"])
        summary = json.loads((path / "summary.json").read_text("utf-8"))
        caregivers = settings["caregivers"]
        run = Run(
            settings=settings,
            plan=plan,
            episodes=pd.read_parquet(path / "episodes.parquet"),
            summary={key: summary[key] for key in ("rows", "comparisons", "versions")},
            maps=pd.read_parquet(path / "maps.parquet"),
            caregiver="paper" if "paper" in caregivers else next((c for c in caregivers if c != "none"), "none"),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise CaregiverError(f"the run in '{folder}' cannot be read: {error}") from error
    if not {run.caregiver, "none"} <= set(caregivers) or run.caregiver == "none":
        raise CaregiverError(
            f"the run in '{folder}' has {' and '.join(caregivers)}: a report compares `none` with a caregiver"
        )
    return run


def write_report(folders: Sequence[str | os.PathLike[str]], film: str | os.PathLike[str] | None = None) -> pathlib.Path:
    """Writes report.html, tables.md and figures/ into the first of some folders.

    Args:
        folders: Of finished runs, each of another world or house.
        film: A film to show; by default the first in the folders, if there is one.

    Returns:
        The path of the page.

    Raises:
        CaregiverError: Some folder has no finished run, or the film is not one.
        StorageError: The report could not be written.
    """
    runs = [read_run(folder) for folder in folders]
    names = [run.name for run in runs]
    if len(set(names)) < len(names):
        raise CaregiverError("the runs are of the same world and house: a report compares different ones")
    film = film or next((f for folder in folders for f in sorted(pathlib.Path(folder).glob("*.mp4"))), None)
    shown = None if film is None else {"name": pathlib.Path(film).name, "data": _film(pathlib.Path(film))}
    sections = [_section(run) for run in runs]
    beside = _side_by_side(runs)
    template = importlib.resources.files("caregiver_mj.viz").joinpath("templates", "report.html").read_text("utf-8")
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.undefined = jinja2.StrictUndefined
    page = environment.from_string(template).render(
        sections=sections, beside=beside, film=shown, paper=PAPER, colours=_css_colours()
    )
    pictures = [picture for section in sections for picture in section["pictures"]]
    folder = pathlib.Path(folders[0])
    try:
        (folder / "figures").mkdir(exist_ok=True)
        for picture in [*pictures, *(beside["pictures"] if beside else ())]:
            (folder / "figures" / f"{picture.name}.svg").write_bytes(picture.svg)
            (folder / "figures" / f"{picture.name}.png").write_bytes(picture.png)
        (folder / "tables.md").write_text(_markdown(sections, beside), "utf-8")
        (folder / "report.html").write_text(page, "utf-8")
    except OSError as error:
        raise StorageError(f"the report in '{folder}' cannot be written: {error.strerror}") from error
    return folder / "report.html"


def novice_name(epsilon: float) -> str:
    """What the paper calls a novice."""
    return "random motion" if epsilon == 1.0 else f"{100 * epsilon:g} % random"


# -- What the page says about a run ------------------------------------------------------------------


def _section(run: Run) -> dict[str, Any]:
    """Everything that the page shows about a run."""
    charts, maps = _charts(run), _maps(run)
    return {
        "run": run,
        "headline": headline(run),
        "published": [_damage_table(run), _timesteps_table(run)],
        "charts": charts,
        "comparison": _comparison_table(run),
        "baselines": _baselines(run),
        "maps": maps,
        "measures": _measures_table(run),
        "pictures": [*charts, *maps],
    }


def headline(run: Run) -> dict[str, Any]:
    """The result in a few numbers: `avoided`, the share of all novices' damage that the caregiver avoids, and more."""
    # Novices of the same episode share their chance, so it is episodes that are drawn again, all novices together.
    damage = run.episodes.pivot_table(index="episode", columns="caregiver", values="damage", aggfunc="sum")
    left, low, high = statistics.ratio_interval(damage[run.caregiver].to_numpy(), damage["none"].to_numpy())
    published = PUBLISHED["damage_normalised"]
    paper = None
    if set(run.novices) <= set(published):
        alone, guarded = np.sum([published[epsilon] for epsilon in run.novices], axis=0)
        paper = f"{100 * (1 - guarded / alone):.0f} %"
    alone, guarded = (run.mean(caregiver, "damage") for caregiver in ("none", run.caregiver))
    facts = [
        (f"timesteps until {DAMAGE_THRESHOLD:g} damage", "timesteps_to_threshold"),
        ("cells visited until then", "cells_visited"),
        (f"toys reached in {EPISODE_TIMESTEPS} timesteps", "toys_reached"),
    ]
    guarded_episodes = run.episodes[run.episodes.caregiver == run.caregiver]
    mishaps = {column: int(guarded_episodes[column].sum()) for column in ("strikes", "candles_dropped")}
    return {
        "avoided": f"{_number(100 * (1 - left), 0)} %" if np.isfinite(left) else None,
        "interval": f"{_number(100 * (1 - high))} to {_number(100 * (1 - low))} %" if np.isfinite(low) else None,
        "paper": paper,
        "damage": {"alone": alone, "guarded": guarded, "most": max(alone, guarded) or 1.0},
        "facts": [
            (label, _number(run.mean("none", column)), _number(run.mean(run.caregiver, column)))
            for label, column in facts
        ],
        "deeds": {c: _number(run.mean(run.caregiver, c)) for c in ("moves_blocked", "interventions_done")},
        "mishaps": mishaps if run.settings["world"] == "house" else None,
        "guarded_episodes": len(guarded_episodes),
        "few": run.settings["episodes"] < FEW,
    }


def _damage_table(run: Run) -> Table:
    rows = []
    for epsilon in run.novices:
        alone, guarded = run.row("none", epsilon), run.row(run.caregiver, epsilon)
        published = PUBLISHED["damage_normalised"].get(epsilon)
        rows.append(
            (
                novice_name(epsilon),
                _with_interval(alone, "damage_normalised_mean", 3),
                "–" if published is None else f"{published[0]:.3f}",
                _with_interval(guarded, "damage_normalised_mean", 3),
                "–" if published is None else f"{published[1]:.3f}",
                _with_interval(run.comparison(run.caregiver, "none", epsilon), "damage_left", 2),
                "–" if published is None else f"{published[1] / published[0]:.2f}",
            )
        )
    columns = ("novice", *(f"{what}, {where}" for what in ("without", "with", "left") for where in _WHERE))
    note = (
        f"Mean normalised damage in {EPISODE_TIMESTEPS} timesteps, and the share of it that is left with the "
        "caregiver; in brackets the 95 % interval. 1.0 is the greatest damage of any episode of the run, here "
        f"{run.episodes.damage.max():g}; the more episodes, the greater that is, so compare the shares left."
    )
    return Table(f"Table I. Damage — {run.title}", columns, rows, note)


def _timesteps_table(run: Run) -> Table:
    rows = []
    for epsilon in run.novices:
        published = PUBLISHED["timesteps_to_threshold"].get(epsilon)
        cells = [novice_name(epsilon)]
        for i, caregiver in enumerate(("none", run.caregiver)):
            cells.append(_with_interval(run.row(caregiver, epsilon), "timesteps_to_threshold_mean"))
            cells.append("–" if published is None else f"{published[i]:.1f}")
        rows.append(tuple(cells))
    columns = ("novice", *(f"{what}, {where}" for what in ("without", "with") for where in _WHERE))
    note = f"Mean timesteps until {DAMAGE_THRESHOLD:g} damage, at most {EPISODE_TIMESTEPS}."
    return Table(f"Table II. Timesteps — {run.title}", columns, rows, note)


def _comparison_table(run: Run) -> Table:
    rows = []
    for epsilon in run.novices:
        row = run.comparison(run.caregiver, "none", epsilon)
        cells = [
            f"{_with_interval(row, f'{column}_difference_mean', 1, sign='+')}\n{_p(row[f'{column}_p'])}"
            for column in _COMPARED
        ]
        rows.append((novice_name(epsilon), *cells))
    note = (
        "With the caregiver less without, paired: episode i has the same novice both times. In brackets the 95 % "
        "bootstrap interval of the mean difference; p by Wilcoxon's signed-rank test, two-sided, "
        f"{run.settings['episodes']} pairs each, not corrected for the {len(rows) * len(_COMPARED)} tests."
    )
    return Table(f"Differences that the caregiver makes — {run.title}", ("novice", *_COMPARED.values()), rows, note)


def _baselines(run: Run) -> dict[str, Any] | None:
    """How the caregiver does against others that act, and where it does not win."""
    if not run.baselines:
        return None
    caregivers = (run.caregiver, *run.baselines)
    rows = []
    for epsilon in run.novices:
        cells = [_with_interval(run.comparison(c, "none", epsilon), "damage_left", 2) for c in caregivers]
        rows.append((novice_name(epsilon), *cells))
    note = "Share of the damage without a caregiver that is left, and its 95 % interval."
    table = Table(f"Damage left by each caregiver — {run.title}", ("novice", *caregivers), rows, note)
    return {"table": table, "verdicts": verdicts(run)}


def verdicts(run: Run) -> list[tuple[bool, str]]:
    """For each baseline whether the caregiver beats it with every novice, and a sentence that says so plainly."""
    found = []
    for baseline in run.baselines:
        rows = [(e, row) for e in run.novices if (row := run.comparison(run.caregiver, baseline, e)) is not None]
        lost = []
        for epsilon, row in rows:
            clear, difference = row["damage_p"] < SIGNIFICANT, row["damage_difference_mean"]
            if not (clear and difference < 0):
                worse = "more damage: " if clear else ""
                numbers = f"{_with_interval(row, 'damage_difference_mean', 2, sign='+')}, {_p(row['damage_p'])}"
                lost.append(f"{worse}{novice_name(epsilon)} {numbers}")
        if not lost:
            found.append((True, f"Beats {baseline} with every novice: less damage, p < {SIGNIFICANT} each."))
        else:
            which = "any novice" if len(lost) == len(rows) else f"{len(lost)} of {len(rows)} novices"
            found.append(
                (False, f"Does not beat {baseline} with {which}. Difference in damage there: {'; '.join(lost)}.")
            )
    return found if run.caregiver == "paper" else []  # the summary compares no other one with baselines


def _measures_table(run: Run) -> Table:
    physical = run.settings["world"] == "house"
    columns = {c: name for c, name in _MEASURES.items() if physical or c not in ("candles_dropped", "strikes")}
    rows = [
        (f"{novice_name(row['epsilon'])}, {row['caregiver']}", *(_number(row[f"{column}_mean"]) for column in columns))
        for row in run.summary["rows"]
    ]
    note = "Means of an episode. Standard deviations and intervals are in summary.json."
    return Table(f"Every measure — {run.title}", ("novice, caregiver", *columns.values()), rows, note)


# -- Figures -----------------------------------------------------------------------------------------


def _charts(run: Run) -> list[Picture]:
    names = [_two_lines(novice_name(epsilon)) for epsilon in run.novices]
    charts = []
    for number, column, quantity, top, caption in (
        (2, "damage_normalised", "normalised damage", 1.0, "Damage, as a share of the greatest of any episode"),
        (3, "timesteps_to_threshold", "timesteps", EPISODE_TIMESTEPS, f"Timesteps until {DAMAGE_THRESHOLD:g} damage"),
        (4, "cells_visited", "cells", None, "Distinct cells visited until then"),
    ):
        alone, guarded = (_series(run, caregiver, column) for caregiver in ("none", run.caregiver))
        figure = figures.bars(names, alone, guarded, quantity, top)
        charts.append(_picture(f"figure_{number}_{run.name}", figure, f"Figure {number}. {caption} — {run.title}"))
    left = [_left_series(run, caregiver, caregiver) for caregiver in (run.caregiver, *run.baselines)]
    caption = f"Damage left, as a share of that without a caregiver, with its 95 % interval — {run.title}"
    return [*charts, _picture(f"damage_left_{run.name}", figures.damage_left(names, left), caption)]


def _series(run: Run, caregiver: str, column: str) -> Series:
    rows = [run.row(caregiver, epsilon) for epsilon in run.novices]
    mean, sd, low, high = (
        np.array([row[f"{column}_{part}"] for row in rows], float) for part in ("mean", "sd", "ci_low", "ci_high")
    )
    published = PUBLISHED.get(column, {})
    which = 0 if caregiver == "none" else 1
    label = "no caregiver" if caregiver == "none" else "with caregiver"
    paper = np.array([published.get(epsilon, (np.nan, np.nan))[which] for epsilon in run.novices])
    return Series(label, mean, low, high, sd, paper)


def _left_series(run: Run, caregiver: str, label: str, novices: Sequence[float] | None = None) -> Series:
    rows = [run.comparison(caregiver, "none", epsilon) or {} for epsilon in novices or run.novices]
    mean, low, high = (
        np.array([row.get(f"damage_left{part}") for row in rows], float) for part in ("", "_ci_low", "_ci_high")
    )
    published = PUBLISHED["damage_normalised"]
    paper = [np.divide(*published[e][::-1]) if e in published else np.nan for e in novices or run.novices]
    return Series(label, mean, low, high, published=np.array(paper))


def _maps(run: Run) -> list[Picture]:
    """Where the toddler went and where it was hurt, without and with the caregiver; one scale for both."""
    maps, pictures = run.maps, []
    for column, quantity, scale, caption in (
        ("visits", "timesteps an episode", figures.WENT, "Where the toddler went"),
        ("damage", "damage an episode", figures.HURT, "Where it was hurt"),
    ):
        cells = {
            caregiver: maps[maps.caregiver == caregiver].groupby(["row", "column"])[column].sum()
            / (run.settings["episodes"] * len(run.novices))
            for caregiver in ("none", run.caregiver)
        }
        top = max(float(values.max()) for values in cells.values())
        for caregiver, values in cells.items():
            who = "without" if caregiver == "none" else "with"
            in_order = values.loc[list(run.plan.free_cells)].to_numpy()
            figure = figures.heat_map(run.plan, in_order, scale, top, quantity)
            name = f"map_{column}_{who}_{run.name}"
            pictures.append(_picture(name, figure, f"{caption}, {who} the caregiver — {run.title}"))
    return pictures


def _picture(name: str, figure: Any, caption: str) -> Picture:
    return Picture(name, figures.as_bytes(figure, "svg"), figures.as_bytes(figure, "png"), caption)


# -- Runs side by side -------------------------------------------------------------------------------


def _side_by_side(runs: list[Run]) -> dict[str, Any] | None:
    """The worlds beside each other: damage left, and how far apart it is."""
    if len(runs) < 2:
        return None
    novices = sorted({epsilon for run in runs for epsilon in run.novices}, reverse=True)
    series = [_left_series(run, run.caregiver, run.title, novices) for run in runs]
    published = series[0].published
    # How much more is left in the house than in the grid, if these are the two.
    shares = {run.settings["world"]: one.mean for run, one in zip(runs, series, strict=True)}
    apart = shares["house"] / shares["grid"] - 1 if len(runs) == 2 and len(shares) == 2 else None
    rows = []
    for i, epsilon in enumerate(novices):
        rows.append(
            (
                novice_name(epsilon),
                *(
                    _with_interval(run.comparison(run.caregiver, "none", epsilon), "damage_left", 2, between="\n")
                    for run in runs
                ),
                "–" if np.isnan(published[i]) else f"{published[i]:.2f}",
                *(() if apart is None else (_percent(apart[i]),)),
            )
        )
    columns = ("novice", *(run.title for run in runs), "published", *(() if apart is None else ("house against grid",)))
    note = "Share of the damage that is left with the caregiver, and its 95 % interval."
    both = [] if apart is None else [i for i in range(len(novices)) if novices[i] >= 0.5 and np.isfinite(apart[i])]
    if both:
        who = ", ".join(novice_name(novices[i]) for i in both)
        note += f" House against grid, on average over {who}: {_percent(float(np.mean(apart[both])))}."
    names = [_two_lines(novice_name(epsilon)) for epsilon in novices]
    figure = figures.damage_left(names, series)
    picture = _picture("damage_left", figure, "Damage left with the caregiver, as a share of that without")
    title = "Damage left, " + " beside ".join(run.title.lower() for run in runs)
    return {"table": Table(title, columns, rows, note), "pictures": [picture]}


# -- Words and numbers -------------------------------------------------------------------------------


def _number(value: float, digits: int = 1, sign: str = "-") -> str:
    """A number with a true minus, and none before a zero."""
    text = f"{value:{sign}.{digits}f}"
    if not float(text):
        text = text.lstrip("+-")
    return text.replace("-", "−")


def _with_interval(row: dict[str, Any] | None, key: str, digits: int = 1, sign: str = "-", between: str = " ") -> str:
    """A mean of the summary with its interval in brackets."""
    if row is None or row[key] is None:
        return "–"
    stem = key.removesuffix("_mean")
    text = _number(row[key], digits, sign)
    if row[f"{stem}_ci_low"] is None:
        return text
    ends = (_number(row[f"{stem}_ci_{end}"], digits, sign) for end in ("low", "high"))
    return f"{text}{between}[{', '.join(ends)}]"


def _p(value: float) -> str:
    if value < 0.001:
        return "p < 0.001"
    return f"p = {value:.3f}" if value < 0.1 else f"p = {value:.2f}"


def _percent(share: float) -> str:
    return f"{_number(100 * share, 0, '+')} %" if np.isfinite(share) else "–"


def _two_lines(name: str) -> str:
    """The name of a novice as it stands under its bars."""
    first, _, last = name.rpartition(" ")
    return f"{first}\n{last}"


def _css_colours() -> dict[str, str]:
    def css(colour: Colour) -> str:
        return "#" + "".join(f"{part:02x}" for part in colour)

    return {
        "ground": css(colours.GROUND),
        "alone": css(figures.ALONE),
        "guarded": css(figures.GUARDED),
        "highlight": css(colours.TODDLER),
    }


def _markdown(sections: list[dict[str, Any]], beside: dict[str, Any] | None) -> str:
    parts = ["# Tables\n"]
    for section in sections:
        run, told = section["run"], section["headline"]
        avoided = f"{told['avoided'] or 'there is none'}"
        avoided += f", 95 % interval {told['interval']}" if told["interval"] else ""
        parts.append(f"## {run.title}\n")
        parts.append(f"Damage avoided with caregiver `{run.caregiver}`: {avoided}.\n")
        parts.append(f"    {run.command()}\n")
        parts += [table.markdown() for table in [*section["published"], section["comparison"]]]
        if section["baselines"]:
            parts.append(section["baselines"]["table"].markdown())
            parts += [f"- {text}" for _, text in section["baselines"]["verdicts"]] + [""]
        parts.append(section["measures"].markdown())
    if beside:
        parts.append(beside["table"].markdown())
    return "\n".join([*parts, f"The paper's numbers: {PAPER}, Tables I and II.\n"])


def _film(path: pathlib.Path) -> str:
    """A film as part of the page."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise CaregiverError(f"the film '{path}' cannot be read: {error.strerror}") from None
    if content[4:8] != b"ftyp":  # how every MP4 file begins
        raise CaregiverError(f"'{path}' is not a film in MP4")
    if len(content) > _LARGEST_FILM * 1e6:
        size = round(len(content) / 1e6)
        raise CaregiverError(f"the film '{path}' has {size} MB, which makes too large a page: {_LARGEST_FILM} at most")
    return f"data:video/mp4;base64,{base64.b64encode(content).decode()}"
