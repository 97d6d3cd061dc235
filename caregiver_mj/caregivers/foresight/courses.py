"""How itineraries go on: from a place, at a moment, by the relocation that is best then."""

from __future__ import annotations

import dataclasses

import numpy as np

from caregiver_mj.caregivers.foresight.forecast import Forecast


@dataclasses.dataclass
class Courses:
    """How far n itineraries have come in each of W worlds.

    Attributes:
        moves: Moves of the children until then, (W, n).
        cost: By how much candles that have been carried, and stairwells that have been guarded, will have done more
            damage than if nothing had been done, likewise.
        place: Where the caregiver is, a number of a place as `Prospects` has them, likewise.
        tables: The table of each candle, (W, n, candles).
        bare: The tables without one, (W, n, bare tables).
    """

    moves: np.ndarray
    cost: np.ndarray
    place: np.ndarray
    tables: np.ndarray
    bare: np.ndarray

    def follow(self, forecast: Forecast) -> np.ndarray:
        """Goes on with the best relocation, if no other one is to come; returns the damage that is then to be expected.

        Args:
            forecast: What is to come.

        Returns:
            Array (W, n).
        """
        prospects, place, target = forecast.prospects, self.place[..., None], self.bare[..., None, :]
        get = self.moves[..., None] + prospects.after_get[place, self.tables]
        moves = self.moves[..., None, None] + prospects.after_place[place[..., None], self.tables[..., None], target]
        cost, closing = relocations(forecast, self.tables, self.bare, get, moves)
        cost += self.cost[..., None, None]
        damage = (cost + closing).reshape(*self.moves.shape, -1)
        best = damage.argmin(axis=2)
        self.moves, self.cost = (take(found.reshape(damage.shape), best) for found in (moves, cost))
        self.move(*np.divmod(best, self.bare.shape[2]))
        return take(damage, best)

    def move(self, candle: np.ndarray, spot: np.ndarray) -> None:
        """Puts a candle on a bare table.

        Args:
            candle: Which one in each course, (W, n).
            spot: Which one of the bare tables, likewise.
        """
        source, self.place = take(self.tables, candle), take(self.bare, spot)
        np.put_along_axis(self.tables, candle[..., None], self.place[..., None], axis=-1)
        np.put_along_axis(self.bare, spot[..., None], source[..., None], axis=-1)


def relocations(
    forecast: Forecast, tables: np.ndarray, bare: np.ndarray, get: np.ndarray, place: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What relocations change.

    Args:
        forecast: What is to come.
        tables: The table of each candle, (W, n, candles).
        bare: The tables without one, (W, n, bare tables).
        get: Moves of the children until each candle is in the hand, (W, n, candles).
        place: Moves until it is on each bare table, (W, n, candles, bare tables).

    Returns:
        By how much the candle will have done more damage than if it had stayed, and the damage of stairwells if the
        caregiver guards them for ever from then on, both (W, n, candles, bare tables).
    """
    world = np.arange(len(tables))[:, None, None]
    at = world[..., None], forecast.moment(place), bare[..., None, :]
    saved = forecast.staying[world, forecast.moment(get), tables]
    return forecast.staying[at] - saved[..., None], forecast.closing[at]


def take(values: np.ndarray, which: np.ndarray) -> np.ndarray:
    """The one of some values (..., values) that is wanted, (...)."""
    return np.take_along_axis(values, which[..., None], axis=-1)[..., 0]
