"""Film the beginning of an episode of `evaluate` in the grid, from above, as a GIF.

With `--sight` it shows the cells in view lighter, the belief about a child in red, and an unseen child as a ring.
"""

from __future__ import annotations

import argparse
import pathlib
from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw

from caregiver_mj.caregivers.registry import make_caregiver
from caregiver_mj.experiments.spec import episode_seed, episode_streams
from caregiver_mj.grid.world import GridWorld
from caregiver_mj.interventions.verb import verb_of
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.viz import colours
from caregiver_mj.viz.chart import GroundPlan
from studies.gif import write

CELL, PAD, CAPTION = 26, 8, 26  # pixels
MILLISECONDS = 160  # of a frame; there is one for the child's move and for each action of the caregiver


class Film:
    """Frames of an episode."""

    def __init__(self, plan: FloorPlan):
        """Draw the background."""
        rows, columns = plan.shape
        self._size = columns * CELL + 2 * PAD, rows * CELL + 2 * PAD
        self._ground = GroundPlan(plan, CELL, PAD)
        self._still = self._ground.draw(Image.new("RGB", self._size, colours.GROUND))
        self.pictures: list[Image.Image] = []

    def add(self, world: GridWorld) -> None:
        """Draw the present moment of a world with one episode."""
        plan, drawn = world.plan, self._still.copy()
        eyes, seen = getattr(world, "eyes", None), True
        if eyes:
            seen = bool(eyes.tracker.seen[0, 0])
            self._shade(drawn, plan, eyes.in_view()[0], 0.0 if seen else eyes.tracker.presence[0, 0])
        canvas, unit = ImageDraw.Draw(drawn), self._ground.unit
        for table in world.candle_table[0]:
            if table >= 0:
                self._disc(canvas, plan.position(plan.tables[table]), 0.18 * unit, colours.CANDLE)
        caregiver = plan.position(plan.caregiver_cells[world.caregiver_cell[0]])
        self._disc(canvas, caregiver, 0.4 * unit, colours.ROBOT)
        if world.holding[0] >= 0:
            self._disc(canvas, caregiver, 0.18 * unit, colours.CANDLE)
        child = plan.position(plan.free_cells[world.child_cell[0, 0]])
        self._disc(canvas, child, 0.3 * unit, colours.TODDLER)
        if not seen:
            self._disc(canvas, child, 0.2 * unit, colours.GROUND)
        page = Image.new("RGB", (self._size[0], self._size[1] + CAPTION), colours.GROUND)
        page.paste(drawn.resize(self._size, Image.Resampling.LANCZOS))
        caption = f"timestep {world.timestep}      damage {world.ledger.damage[0]:g}"
        if eyes:
            caption += f"      {verb_of(world.orders[0].verb).describe(plan, world.orders[0])}"
        ImageDraw.Draw(page).text((PAD, self._size[1]), caption, colours.TEXT, font_size=15)
        self.pictures.append(page)

    def _shade(self, drawn: Image.Image, plan: FloorPlan, in_view: np.ndarray, presence: np.ndarray | float) -> None:
        """Lighten free cells, bool (cells,), and redden them by a probability."""
        red = np.minimum(1.0, 3.0 * np.broadcast_to(presence, in_view.shape))
        for cell, is_seen, share in zip(plan.free_cells, in_view, red, strict=True):
            left, top, right, bottom = map(round, self._ground.square(cell))
            box = left, top, right + 1, bottom + 1
            shade = drawn.crop(box)
            for colour, much in ((colours.TEXT, 0.18 * is_seen), (colours.HARM, 0.8 * share)):
                shade = Image.blend(shade, Image.new("RGB", shade.size, colour), much)
            drawn.paste(shade, box)

    def _disc(self, canvas: ImageDraw.ImageDraw, position, radius: float, colour: tuple[int, int, int]) -> None:
        x, y = self._ground.pixel(position)
        canvas.ellipse((x - radius, y - radius, x + radius, y + radius), colour, colours.GROUND, round(radius / 6))


class Filmed(GridWorld):
    """A world that is filmed after every move."""

    film: Film

    def move_children(self) -> None:
        super().move_children()
        self.film.add(self)

    def act_caregiver(self, caregiver) -> None:
        super().act_caregiver(caregiver)
        self.film.add(self)


def main(arguments: Sequence[str] | None = None) -> None:
    """Film an episode, write the GIF, and print the damage."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("house", help="a name or a file")
    parser.add_argument("out", type=pathlib.Path, metavar="FILE.gif")
    parser.add_argument("--caregiver", default="paper")
    parser.add_argument("--epsilon", default="1")
    parser.add_argument("--sight", help="what the caregiver sees, if not everything: walls, camera or rooms:N")
    parser.add_argument("--seed", type=int, default=0, help="of the run to which the episode belongs")
    parser.add_argument("--end", type=int, default=25, help="timestep with which it ends")
    options = parser.parse_args(arguments)
    plan = FloorPlan.load(options.house)
    sight = {"sight": options.sight} if options.sight else {}
    world = Filmed(plan, options.epsilon, make_caregiver(options.caregiver, plan), **sight)
    world.reset([episode_streams(episode_seed(options.seed, 0), 1)])
    world.film = Film(plan)
    for _ in range(options.end):
        world.step()
    write(options.out, world.film.pictures, MILLISECONDS)
    print(f"{options.out}: damage {world.ledger.damage[0]:g} in {options.end} timesteps")


if __name__ == "__main__":
    main()
