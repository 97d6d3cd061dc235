"""What adults bear of a robot that touches them: to be put beside forces on a child, not to be taken for its limits.

Source: the pain threshold register of the German accident insurers (DGUV 2011, "BG/BGIA risk assessment recommendations
according to machinery directive: design of workplaces with collaborative robots"), as reprinted in Buxbaum and Sen,
"Kollaborierende Roboter in der Pflege", table 1.4 (in: Bendel (ed.), Pflegeroboter, Springer 2018, open access).
ISO/TS 15066:2016 has a table of the same kind in its annex A, from another study of adults.
"""

from __future__ import annotations

import dataclasses

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
