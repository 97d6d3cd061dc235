"""A report's tables and figures in Markdown."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import Any

from caregiver_mj.viz.report import published
from caregiver_mj.viz.report.charts import Picture
from caregiver_mj.viz.report.child import why_all_timesteps
from caregiver_mj.viz.report.disclosure import disclosures
from caregiver_mj.viz.report.harm import HARM_IS
from caregiver_mj.viz.report.words import number


def markdown(sections: Sequence[dict[str, Any]], beside: dict[str, Any] | None) -> str:
    """The content of tables.md: all tables, with the figures that belong to them."""
    parts = ["# Tables\n", "## Harm\n"]
    for section in sections:
        parts += [f"{section['run'].title}. {section['harm']['sentence']}\n", section["harm"]["table"].markdown()]
    parts.append(f"{HARM_IS}\n")
    for section in sections:
        parts += _section(section)
    parts += [beside["table"].markdown(), *_figures(beside["pictures"])] if beside else []
    parts += ["## To know before comparing\n", *(f"- {text}" for text in disclosures([s["run"] for s in sections])), ""]
    if any(section["cited"] for section in sections):
        parts.append(f"The paper's numbers: {published.PAPER}, Tables I and II.\n")
    return "\n".join(parts)


def _section(section: dict[str, Any]) -> list[str]:
    """A run's part, as a list of paragraphs."""
    run, told, left, child = (section[name] for name in ("run", "headline", "left", "child"))
    avoided = told["avoided"] or "there is none"
    avoided += f", 95 % interval {told['interval']}" if told["interval"] else ""
    avoided += f"; of {number(told['damage']['alone'])} an episode alone, {number(told['damage']['guarded'])} is left"
    parts = [f"## {run.title}\n", f"Damage avoided with caregiver `{run.caregiver}`: {avoided}.\n"]
    parts += [textwrap.indent(run.command(), "    ") + "\n", left["table"].markdown()]
    parts += [f"{left['floor']}\n"] if left["floor"] else []
    parts += _figures(left["pictures"])
    parts += [left["wins"].markdown()] if left["wins"] else []
    parts += [*(f"- {text}" for _, text in left["verdicts"]), ""] if left["verdicts"] else []
    parts += [section["kinds"]["table"].markdown(), *_figures(section["kinds"]["pictures"])]
    if child:
        parts += [child["table"].markdown(), *_figures(child["pictures"]), f"{why_all_timesteps()}\n"]
        parts += [table.markdown() for table in child["more"]]
    parts += [table.markdown() for table in section["contacts"]["tables"]] if section["contacts"] else []
    parts += [table.markdown() for table in [*section["published"], section["comparison"]]]
    parts += [section["children"].markdown()] if section["children"] else []
    return parts + [table.markdown() for table in section["measures"]]


def _figures(pictures: Sequence[Picture]) -> list[str]:
    """Where to find them; of one that there is for narrow and for wide pages the wide one."""
    names = {picture.name for picture in pictures}
    shown = [picture for picture in pictures if f"{picture.name}_wide" not in names]
    return [f"![{picture.caption}](figures/{picture.name}.png)\n" for picture in shown]
