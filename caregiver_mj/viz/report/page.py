"""The report of one or more finished runs: one page for people, tables in Markdown, and figures."""

from __future__ import annotations

import os
import pathlib
from collections.abc import Sequence
from typing import Any

import jinja2

from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.run_folder import StorageError
from caregiver_mj.viz import colours, figures
from caregiver_mj.viz.colours import Colour
from caregiver_mj.viz.report import published
from caregiver_mj.viz.report.beside import side_by_side
from caregiver_mj.viz.report.charts import Picture
from caregiver_mj.viz.report.child import why_all_timesteps
from caregiver_mj.viz.report.disclosure import disclosures
from caregiver_mj.viz.report.film import Film, found_film, make_film
from caregiver_mj.viz.report.harm import HARM_IS
from caregiver_mj.viz.report.markdown import markdown
from caregiver_mj.viz.report.reading import read_run
from caregiver_mj.viz.report.section import section
from caregiver_mj.viz.report.words import SEVERAL, SINGLE


def write_report(
    folders: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    film: str | os.PathLike[str] | None = None,
    *,
    render: bool = False,
) -> pathlib.Path:
    """Writes report.html, tables.md and figures/ into the first of some folders.

    Whatever the order of the folders, runs over several houses come first, and house `paper` last.

    Args:
        folders: Of finished runs, each of another world or house.
        film: A film to show; by default the first in the folders, if there is one.
        render: Whether to film the first episode of a run instead.

    Returns:
        The path of the page.

    Raises:
        CaregiverError: Some folder has no finished run, or the film is not one.
        RenderingError: There is no OpenGL to render with.
        StorageError: The report could not be written.
    """
    folders = [folders] if isinstance(folders, str | os.PathLike) else folders
    if not folders:
        raise CaregiverError("a report is of at least one run")
    given = [read_run(folder) for folder in folders]
    places = [(run.settings.world, *(plan.name for plan in run.settings.plans)) for run in given]
    if len(set(places)) < len(places):
        raise CaregiverError(
            "the runs are of the same world and house, and a report is of different ones; there are `compare`, and "
            "`pool` for runs of different seeds"
        )
    runs = sorted(given, key=lambda run: run.rank)
    shown: Film | None
    if render:
        shown = make_film(runs, folders[0])
    else:
        shown = Film(pathlib.Path(film), pathlib.Path(film).name) if film else found_film(folders)
    film_on_page = None if shown is None else {"name": shown.caption, "data": shown.data()}
    sections, beside = [section(run) for run in runs], side_by_side(runs)
    page = _page(sections, beside, film_on_page)
    pictures = [picture for one in sections for picture in one["pictures"]]
    pictures += beside["pictures"] if beside else []
    return _write(pathlib.Path(folders[0]), page, markdown(sections, beside), pictures)


def _page(sections: list[dict[str, Any]], beside: dict[str, Any] | None, film: dict[str, str] | None) -> str:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("caregiver_mj.viz.report"), autoescape=True, trim_blocks=True, lstrip_blocks=True
    )
    environment.undefined = jinja2.StrictUndefined
    several = any(one["run"].several for one in sections)
    return environment.get_template("report.html").render(
        sections=sections,
        harm_is=HARM_IS,
        beside=beside,
        film=film,
        paper=published.PAPER,
        disclosures=disclosures([one["run"] for one in sections]),
        why_all_timesteps=why_all_timesteps(),
        cited=any(one["cited"] for one in sections),
        nouns=SEVERAL if several else SINGLE,
        several=several,
        colours=_css_colours(),
    )


def _css_colours() -> dict[str, str]:
    def css(colour: Colour) -> str:
        return "#" + "".join(f"{part:02x}" for part in colour)

    return {
        "ground": css(colours.GROUND),
        "alone": css(figures.ALONE),
        "guarded": css(figures.GUARDED),
        "highlight": css(colours.TODDLER),
    }


def _write(folder: pathlib.Path, page: str, tables_text: str, pictures: Sequence[Picture]) -> pathlib.Path:
    try:
        (folder / "figures").mkdir(exist_ok=True)
        for picture in pictures:
            (folder / "figures" / f"{picture.name}.svg").write_bytes(picture.svg)
            (folder / "figures" / f"{picture.name}.png").write_bytes(picture.png)
        (folder / "tables.md").write_text(tables_text, "utf-8")
        (folder / "report.html").write_text(page, "utf-8")
    except OSError as error:
        raise StorageError(f"the report in '{folder}' cannot be written: {error.strerror}") from error
    return folder / "report.html"
