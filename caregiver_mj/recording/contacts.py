"""Contacts of the robot with children: what is counted of them, and what adults bear on the same parts of the body.

What adults bear is to be put beside forces on a child, not to be taken for its limits.
Source: the pain threshold register of the German accident insurers (DGUV 2011, "BG/BGIA risk assessment recommendations
according to machinery directive: design of workplaces with collaborative robots"), as reprinted in Buxbaum and Sen,
"Kollaborierende Roboter in der Pflege", table 1.4 (in: Bendel (ed.), Pflegeroboter, Springer 2018, open access).
ISO/TS 15066:2016 has a table of the same kind in its annex A, from another study of adults; ISO 10218-2:2025 has taken
it over. ISO 13482:2014, of personal care robots, covers contact with people of any age, as hazards to assess and reduce
for each robot. No compliance with any of them is claimed.
"""

from __future__ import annotations

import dataclasses
import math
import types
from collections.abc import Iterable
from typing import Protocol

from caregiver_mj.recording.record import COLUMNS

REGIONS = {"legs": 0.24, "trunk": 0.54, "head": math.inf}  # of a child of 0.80 m, by how high each reaches, metres
STRIKE_SPEED = 0.05  # m/s of the robot where it touches a child, above which that is a strike
STRIKE_PAUSE = 0.5  # seconds within which contacts are one strike
# Contacts by the greatest speed of the robot in them, m/s, up to which each band reaches. Creeping: no strike.
# Slow: 0.25 m/s is the "reduced speed" of ISO 10218:2025 for an industrial robot near its operator, an adult.
# Fast: the rest. Both robots stay far below the 1.5 m/s of Paez-Granados and Billard, see `CAUTION`.
BANDS = {"creeping": STRIKE_SPEED, "slow": 0.25, "fast": math.inf}
PRESSING = 0.5  # seconds of contact from which on the robot presses, or is pressed against
FLAME_CLEAR = 0.3  # metres; the 12 inches that NFPA and makers ask for between a burning candle and clothing
WAX_CLEAR = 0.1  # metres between a child and the candle itself: own
FAR = 1.0  # metres beyond which no distance is told
CAUTION = (
    "These limits are for adults at work, and nothing here claims to keep them: what a child of a year and a half can "
    "bear is less and in no such table, and its head is as high as their hips. Where children are thought of, no "
    "contact at all is asked for, as by EN 16005 of automatic doors that many children use. In crash tests with the "
    "dummy of a child the risk of a serious injury came below 5 % only below 1.5 m/s (Paez-Granados and Billard, "
    "Scientific Reports 12, 5285, 2022)."
)


@dataclasses.dataclass(frozen=True)
class BodyLimit:
    """The limits of one part of the body."""

    region: str  # where it is, one of `recording.contacts.REGIONS`
    part: str  # what it is called
    clamping: float  # greatest force while clamped or squeezed, N
    impact: float  # greatest force of an impact, N


BODY_LIMITS = (
    BodyLimit("head", "skull, forehead", 130, 175),
    BodyLimit("head", "face", 65, 90),
    BodyLimit("head", "neck, at the sides and behind", 145, 190),
    BodyLimit("head", "throat", 35, 35),
    BodyLimit("trunk", "back, shoulders", 210, 250),
    BodyLimit("trunk", "chest", 140, 210),
    BodyLimit("trunk", "belly", 110, 160),
    BodyLimit("trunk", "pelvis", 180, 250),
    BodyLimit("trunk", "upper arm, elbow", 150, 190),
    BodyLimit("trunk", "forearm, wrist", 160, 220),
    BodyLimit("trunk", "hand, fingers", 135, 180),
    BodyLimit("legs", "thigh, knee", 220, 250),
    BodyLimit("legs", "lower leg", 140, 170),
    BodyLimit("legs", "foot, ankle", 125, 160),
)


class Touched(Protocol):
    """What `Contacts` reads of a contact: the part of the robot that has to do with it, and its height, metres."""

    @property
    def part(self) -> str: ...
    @property
    def height(self) -> float: ...


class Contacts(types.SimpleNamespace):
    """Counts of one episode in the house: an attribute for each column "contact" of `EpisodeRecord`."""

    def __init__(self) -> None:
        counted = (column for column in COLUMNS if column.role == "contact")
        super().__init__(**{column.name: 0 if column.type == "int" else 0.0 for column in counted})
        self.flame_distance = self.wax_distance = FAR

    def press(self, forces: dict[str, float], seconds: float) -> None:
        """Take in the forces on each region of one child, N, in a physics step."""
        force = sum(forces.values())
        self.contact_seconds += seconds
        self.contact_impulse += force * seconds
        greatest = {"contact_force": force} | {f"contact_force_{region}": part for region, part in forces.items()}
        for column, part in greatest.items():
            setattr(self, column, max(getattr(self, column), part))

    def touch(self, touches: Iterable[Touched], seconds: float) -> None:
        """Take in what of the robot, and what it holds, touched which parts of one child in a physics step."""
        parts = {touch.part for touch in touches} - {""}
        for name in parts | {region_at(touch.height) for touch in touches}:
            column = f"contact_seconds_{name}"
            setattr(self, column, getattr(self, column) + seconds)

    def grade(self, before: str, band: str) -> None:
        """Count a contact in a band, one of `BANDS`, and no longer in the one before, which is "" as it begins."""
        if before != band:
            for name, change in ((before, -1), (band, 1)) if before else ((band, 1),):
                setattr(self, f"contacts_{name}", getattr(self, f"contacts_{name}") + change)

    def carry(self, flame: float, wax: float, seconds: float) -> None:
        """Take in how far flame and wax of a candle in the hand were from the nearest child, metres."""
        self.flame_distance, self.wax_distance = min(self.flame_distance, flame), min(self.wax_distance, wax)
        self.flame_seconds += seconds * (flame < FLAME_CLEAR)
        self.wax_seconds += seconds * (wax < WAX_CLEAR)

    def outcome(self) -> dict[str, float]:
        """Return the columns of the record."""
        return dict(vars(self))


def region_at(height: float) -> str:
    """Return which region of a child something touches at a height above the floor, metres."""
    return next(region for region, top in REGIONS.items() if height < top)


def band_of(speed: float) -> str:
    """Return which of `BANDS` a contact is in whose greatest speed is this, m/s."""
    return next(band for band, top in BANDS.items() if speed <= top)
