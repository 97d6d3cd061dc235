"""Contacts of the robot with children: what is counted of them, and what adults bear on the same parts of the body.

What adults bear is to be put beside forces on a child, not to be taken for its limits.
Source: the pain threshold register of the German accident insurers (DGUV 2011, "BG/BGIA risk assessment recommendations
according to machinery directive: design of workplaces with collaborative robots"), as reprinted in Buxbaum and Sen,
"Kollaborierende Roboter in der Pflege", table 1.4 (in: Bendel (ed.), Pflegeroboter, Springer 2018, open access).
ISO/TS 15066:2016 has a table of the same kind in its annex A, from another study of adults.
"""

from __future__ import annotations

import dataclasses
import math

REGIONS = {"legs": 0.24, "trunk": 0.54, "head": math.inf}  # of a child of 0.80 m, by how high each reaches, metres
STRIKE_SPEED = 0.05  # m/s of the robot where it touches a child, above which that is a strike
STRIKE_PAUSE = 0.5  # seconds within which contacts are one strike
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
    """The limits of one part of the body.

    Attributes:
        region: Where it is, one of `recording.contacts.REGIONS`.
        part: What it is called.
        clamping: Greatest force while clamped or squeezed, N.
        impact: Greatest force of an impact, N.
    """

    region: str
    part: str
    clamping: float
    impact: float


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


@dataclasses.dataclass
class Contacts:
    """Counts of one episode in the house, named and explained as the columns "contact" of `EpisodeRecord`."""

    strikes_surface: int = 0
    contact_speed: float = 0.0
    contact_seconds: float = 0.0
    pressings: int = 0
    contact_force: float = 0.0
    contact_force_legs: float = 0.0
    contact_force_trunk: float = 0.0
    contact_force_head: float = 0.0
    contact_impulse: float = 0.0
    flame_distance: float = FAR
    flame_seconds: float = 0.0
    wax_distance: float = FAR
    wax_seconds: float = 0.0

    def press(self, forces: dict[str, float], seconds: float) -> None:
        """Take in the forces on each region of one child, N, in a physics step."""
        force = sum(forces.values())
        self.contact_seconds += seconds
        self.contact_impulse += force * seconds
        self.contact_force = max(self.contact_force, force)
        for region, part in forces.items():
            column = f"contact_force_{region}"
            setattr(self, column, max(getattr(self, column), part))

    def carry(self, flame: float, wax: float, seconds: float) -> None:
        """Take in how far flame and wax of a candle in the hand were from the nearest child, metres."""
        self.flame_distance, self.wax_distance = min(self.flame_distance, flame), min(self.wax_distance, wax)
        self.flame_seconds += seconds * (flame < FLAME_CLEAR)
        self.wax_seconds += seconds * (wax < WAX_CLEAR)

    def outcome(self) -> dict[str, float]:
        """Return the columns of the record."""
        return dataclasses.asdict(self)


def region_at(height: float) -> str:
    """Return which region of a child something touches at a height above the floor, metres."""
    return next(region for region, top in REGIONS.items() if height < top)
