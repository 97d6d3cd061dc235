"""What stands still in the house, from above."""

from __future__ import annotations

import numpy as np
from PIL import Image, ImageDraw

from caregiver_mj.plans.cell_graph import Cell
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.symbols import BIN, STAIRWELL, WALL
from caregiver_mj.viz import colours
from caregiver_mj.viz.colours import GROUND, mix
from caregiver_mj.viz.hud.text import FINE

Square = tuple[float, float, float, float]  # left, top, right, bottom, in pixels of the fine drawing
_TREADS = 4  # of a stairwell


class GroundPlan:
    """Draws the house once, `FINE` times larger than it is shown, and says where in that drawing things are.

    Attributes:
        plan: The house.
        cell: Side of a cell as it is shown, pixels.
        unit: Side of a cell in the fine drawing, pixels.
    """

    def __init__(self, plan: FloorPlan, cell: int, pad: int):
        """Prepares a drawing.

        Args:
            plan: The house.
            cell: Side of a cell as it is shown, pixels.
            pad: Width of the rim around the house, likewise.
        """
        self.plan, self.cell, self.unit = plan, cell, cell * FINE
        self._pad = pad

    def pixel(self, position: np.ndarray) -> tuple[float, float]:
        """Where a point in metres, of which the first two numbers count, lies in the fine drawing."""
        rows, columns = self.plan.shape
        x = float(position[0]) / self.plan.cell_size + columns / 2
        y = rows / 2 - float(position[1]) / self.plan.cell_size
        return (x * self.cell + self._pad) * FINE, (y * self.cell + self._pad) * FINE

    def square(self, cell: Cell) -> Square:
        """What a cell covers in the fine drawing."""
        x, y = self.pixel(self.plan.position(cell))
        r = self.cell * FINE / 2
        return x - r, y - r, x + r - 1, y + r - 1

    def draw(self, card: Image.Image) -> Image.Image:
        """A fine drawing of the house on a card."""
        drawn = card.resize((card.width * FINE, card.height * FINE))
        canvas, plan = ImageDraw.Draw(drawn), self.plan
        for cell in np.ndindex(plan.shape):
            square = self.square(cell)
            canvas.rectangle(square, colours.WALL if plan[cell] == WALL else colours.FLOOR)
            if plan[cell] == STAIRWELL:
                _draw_stairs(canvas, square)
        inner = 0.14 * self.unit
        for cells, colour in ((plan.tables, colours.TABLE), (plan.cells_of(BIN), colours.BIN)):
            for cell in cells:
                left, top, right, bottom = self.square(cell)
                box = (left + inner, top + inner, right - inner, bottom - inner)
                canvas.rounded_rectangle(box, radius=0.15 * self.unit, fill=colour)
        return drawn


def _draw_stairs(canvas: ImageDraw.ImageDraw, square: Square) -> None:
    left, top, right, bottom = square
    canvas.rectangle(square, mix(colours.STAIRWELL, GROUND, 0.6))
    for tread in range(_TREADS):
        y = top + (bottom - top) * (tread + 0.5) / _TREADS
        canvas.line((left, y, right, y), colours.STAIRWELL, width=max(1, round((bottom - top) / _TREADS * 0.4)))
