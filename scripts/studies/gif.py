"""Makes a moving picture of a part of an episode in the house, with the display, faster than it was, as a GIF."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import pathlib
from collections.abc import Iterable, Iterator

import numpy as np
from PIL import Image

from caregiver_mj.children.child_group import ChildGroup
from caregiver_mj.experiments.spec import EpisodeSpec
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz.episode import Episode
from caregiver_mj.viz.film import Picture, Studio
from study import Parser

HOUSE = "house-6-13x9-rooms2-stairwells2-candles2-tables2-bins3"  # small, so that one sees what is going on
HOME = "home-2-10x9-rooms1-stairwells0-candles0-tables2-bins2-gates1-mugs1-batteries1"
FRAMES_A_SECOND, SPEED = 10, 2.0  # of the picture; of its time over that of the house
COLOURS = 255
_TRAIL_SECONDS = 20.0


def frames(episode: Episode, begin: float, end: float, width: int, height: int) -> Iterator[Image.Image]:
    """What happens from one moment to another, in seconds of the house."""
    step = SPEED / FRAMES_A_SECOND
    studio = Studio(episode, Picture(width, height), round(_TRAIL_SECONDS / step))
    for number in range(round(begin / step), round(end / step)):
        if not episode.run_until(number * step):
            return
        yield Image.fromarray(studio.frame())


def write(path: pathlib.Path, pictures: Iterable[Image.Image], milliseconds: int = 1000 // FRAMES_A_SECOND) -> None:
    """Writes a GIF that goes round and round, all of it with the colours of its first, middle and last picture."""
    taken = [*pictures]
    some = np.concatenate([np.asarray(taken[number]) for number in (0, len(taken) // 2, -1)])
    palette = Image.fromarray(some).quantize(COLOURS, Image.Quantize.MAXCOVERAGE)
    first, *others = (picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in taken)
    first.save(path, save_all=True, append_images=others, duration=milliseconds, loop=0, optimize=True)


def add_options(parser: Parser) -> None:
    """Declare the options."""
    parser.add("out", pathlib.Path("docs/home.gif"), metavar="FILE.gif", type=pathlib.Path)
    parser.add("house", HOME)
    parser.add("caregiver", "nearest-first")
    parser.add("epsilon", "0.5")
    parser.add("seed", 2, "of the run to which the episode belongs")
    parser.add("begin", 0.0, "seconds since the episode's start")
    parser.add("end", 40.0, "seconds since the episode's start")
    parser.add("width", 640, "pixels")
    parser.add("height", 360)


def run(options: argparse.Namespace) -> None:
    """Film, and write the picture."""
    family, plan = ChildGroup.parse(options.epsilon), FloorPlan.load(options.house)
    plan = dataclasses.replace(plan, name="-".join(plan.name.split("-")[:2]))  # there is no room for more
    episode = Episode(EpisodeSpec(plan, family, options.caregiver, seed=options.seed))
    with contextlib.closing(episode.env):
        write(options.out, frames(episode, options.begin, options.end, options.width, options.height))
    print(options.out)
