"""What the caregiver can do now in a large house, and what is to be expected of it if relocations follow.

An itinerary is a sequence of relocations, after which the caregiver guards the stairwells for ever. That the children
could meanwhile do what changes its mind is not thought of, but for the guarding (it decides anew all the time). So an
itinerary costs what each candle does on the table on which it then is, and what stairwells do meanwhile, all of which
`Prospects` know.
"""

from __future__ import annotations

import functools

import numpy as np

from caregiver_mj.caregivers.foresight.courses import Courses, relocations, take
from caregiver_mj.caregivers.foresight.forecast import Forecast
from caregiver_mj.caregivers.foresight.options import Options
from caregiver_mj.caregivers.foresight.prospects import Prospects
from caregiver_mj.caregivers.foresight.travel import timesteps

FOLLOWED = 16  # relocations that look best, and are looked at together with what could follow
FOLLOWING = 1  # relocations that follow: two were no better
STAYS = np.array([1, 2, 4, 8, 16])  # moves of a child for which to stay in a post before they do
_AT_ONCE = 32  # worlds that are thought of at a time, so that it takes little memory


class Itineraries(Options):
    """Everything that can be done in W worlds of a house that has `Prospects`, but no `Values`."""

    followed, following = FOLLOWED, FOLLOWING

    @functools.cached_property
    def damage(self) -> np.ndarray:
        count = len(self._cell)
        return np.concatenate([self._of(slice(first, first + _AT_ONCE)) for first in range(0, count, _AT_ONCE)])

    def _of(self, worlds: slice) -> np.ndarray:
        """Expected damage of each option in some of the worlds."""
        prospects, child, cell = self._values, self._child[worlds], self._cell[worlds]
        assert isinstance(prospects, Prospects)  # not `Values`, which are for `Options` themselves
        forecast = Forecast(prospects, child, self._belief[worlds])
        actions = np.max([prospects.detours.actions(each, cell) for each in child.T], axis=0)  # (W, goals)
        to_post, to_table = np.split(actions, [len(prospects.ways.posts)], axis=1)
        pace = prospects.ways.pace
        left = np.broadcast_to(self._left, len(self._cell))[worlds][:, None]
        to_post = timesteps(to_post, left, pace)
        world, post = np.arange(len(cell))[:, None], np.arange(to_post.shape[1])
        there = forecast.moment(to_post)
        damage = forecast.exposed[world, there] + forecast.guarding[world, there, post]
        tables, bare = self._tables[worlds, None], self._bare[worlds, None]
        if not tables.size or not bare.size:
            return damage
        get = take(to_table[:, None, None], tables) + pace.get  # (W, 1, candles)
        onward = prospects.ways.onward[cell[:, None, None, None], tables[..., None], bare[..., None, :]]
        place = timesteps(get[..., None] + onward + pace.place, left[..., None, None], pace)
        cost, closing = relocations(forecast, tables, bare, timesteps(get, left[..., None], pace), place)
        placed = (cost + closing).reshape(len(cell), -1)
        if self.following:
            best = np.argpartition(placed, min(self.followed, placed.shape[1]) - 1, axis=1)[:, : self.followed]
            chosen = (np.take_along_axis(each.reshape(placed.shape), best, axis=1) for each in (place, cost))
            courses = self._courses(tables, bare, *chosen)
            courses.move(*np.divmod(best, bare.shape[2]))
            placed[world, best] = np.minimum(placed[world, best], self._followed(forecast, courses))
            followed = self._followed(forecast, self._staying(forecast, tables, bare, to_post))
            damage = np.minimum(damage, followed.reshape(*damage.shape, -1).min(axis=2))
        return np.concatenate([damage, placed], axis=1)

    def _staying(self, forecast: Forecast, tables: np.ndarray, bare: np.ndarray, to_post: np.ndarray) -> Courses:
        """Courses that begin with every post, in which the caregiver stays for a while."""
        world, post = np.arange(len(to_post))[:, None, None], np.arange(to_post.shape[1])[:, None]
        leave = to_post[..., None] + STAYS
        there, gone = forecast.moment(to_post)[..., None], forecast.moment(leave)
        until, since = forecast.exposed[world, there], forecast.exposed[world, gone]
        shut = forecast.shut[world, gone, post] - forecast.shut[world, there, post]
        courses = self._courses(tables, bare, *(each.reshape(len(leave), -1) for each in (leave, until + shut - since)))
        courses.place = forecast.prospects.tables + np.broadcast_to(post, leave.shape).reshape(courses.moves.shape)
        return courses

    def _courses(self, tables: np.ndarray, bare: np.ndarray, moves: np.ndarray, cost: np.ndarray) -> Courses:
        each = (np.repeat(one, moves.shape[1], axis=1) for one in (tables, bare))
        return Courses(moves, cost, np.zeros_like(moves), *each)

    def _followed(self, forecast: Forecast, courses: Courses) -> np.ndarray:
        """The least damage with one to all of the relocations that can follow, (W, n)."""
        return np.min([courses.follow(forecast) for _ in range(self.following)], axis=0)
