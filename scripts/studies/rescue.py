"""Makes the moving picture of the README: a rescue from close by, beside the same episode without the robot."""

from __future__ import annotations

import argparse
import contextlib
import pathlib
from collections.abc import Iterator

import numpy as np
from PIL import Image, ImageDraw

from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.errors import CaregiverError
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import colours, director
from caregiver_mj.viz.cameras import StillCamera
from caregiver_mj.viz.episode import Episode
from studies.gif import write
from study import Parser

MILLISECONDS = 80  # of a picture; it runs as fast as the house does
_GAP, _EDGE = 6, 6  # pixels between the two, and of the edge round one in which a child is hurt
_AROUND = 1.2  # metres of room round those who are seen at the beginning


class Panel:
    """One of the two films, from one place."""

    def __init__(self, spec: EpisodeSpec, begin: float):
        self.episode = Episode(spec)
        self.episode.run_until(begin)

    def aim(self, points: np.ndarray, azimuth: float, width: int, height: int) -> None:
        """Set the camera up for all that is to be seen, (n, 2), metres."""
        physics = self.episode.env.physics
        physics.model.vis.quality.numquads = 1  # as in films
        physics.fit_pictures(width, height)
        self._camera = StillCamera(
            physics, director.close_pose(points, width / height, azimuth, _AROUND), width, height
        )

    def look(self, seconds: float) -> Image.Image:
        """Take a picture at a time of the episode."""
        self.episode.run_until(seconds)
        picture = Image.fromarray(self._camera.render())
        if self.episode.env.task.children.harm:
            box = 0, 0, picture.width - 1, picture.height - 1
            ImageDraw.Draw(picture).rectangle(box, outline=colours.HARM, width=_EDGE)
        return picture


def frames(panels: list[Panel], options: argparse.Namespace) -> Iterator[Image.Image]:
    """What happens in both, the pictures side by side."""
    width, begin, plan = (options.width - _GAP) // 2, options.begin, panels[0].episode.env.task.plan
    cast = [director.cast(panel.episode.hud_state(1))[:, :2] for panel in panels]
    stairs = [plan.position((row + down, column + right)) for (row, column), (down, right) in _ways_down(plan)]
    if not stairs:
        raise CaregiverError(f"house must have stairs for this film, got '{plan.name}'")
    nearest = min(stairs, key=lambda place: np.linalg.norm(place - cast[0][0]))
    for panel in panels:
        panel.aim(np.concatenate([*cast, [nearest]]), np.radians(options.azimuth), width, options.height)
    for number in range(round((options.end - begin) * 1000 / MILLISECONDS)):
        page = Image.new("RGB", (options.width, options.height), "white")
        for panel, left in zip(panels, (0, options.width - width), strict=True):
            page.paste(panel.look(begin + number * MILLISECONDS / 1000), (left, 0))
        yield page


def _ways_down(plan: FloorPlan) -> list[tuple[Cell, Cell]]:
    """The landings, and the steps from them to their stairs."""
    return [(cell, step) for cell, step in zip(plan.stairwells, plan.stair_directions, strict=True) if step]


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("out", pathlib.Path("docs/caregiver.gif"), metavar="FILE.gif", type=pathlib.Path)
    parser.add("house", "paper")
    parser.add("caregiver", "expected-danger")
    parser.add("epsilon", "0.5")
    parser.add("seed", 26, "of the run to which the episode belongs")
    parser.add("begin", 21.0, "seconds since the episode's start")
    parser.add("end", 29.0, "seconds since the episode's start")
    parser.add("azimuth", 150.0, "degrees from east, of where the cameras look")
    parser.add("width", 960, "pixels")
    parser.add("height", 400, "pixels")


def run(options: argparse.Namespace) -> None:
    """Film both, and write the picture."""
    family, plan = ChildGroup.parse(options.epsilon), FloorPlan.load(options.house)
    specs = [EpisodeSpec(plan, family, name, seed=options.seed) for name in (options.caregiver, "none")]
    panels = [Panel(spec, options.begin) for spec in specs]
    with contextlib.ExitStack() as closing:
        for panel in panels:
            closing.callback(panel.episode.env.close)
        write(options.out, frames(panels, options), MILLISECONDS)
    print(f"{options.out}: {options.out.stat().st_size / 1e6:.2f} MB")
