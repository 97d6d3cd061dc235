"""Sizes of the candle and the furniture, read from their models: what stands in a model stands nowhere else."""

from __future__ import annotations

import dataclasses
import functools
import importlib.resources
from xml.etree import ElementTree


@dataclasses.dataclass(frozen=True)
class Candle:
    """A candle that stands upright.

    Attributes:
        radius: Metres.
        height: Metres.
    """

    radius: float
    height: float


@dataclasses.dataclass(frozen=True)
class Box:
    """A piece of furniture that stands on the floor, square and solid.

    Attributes:
        half_size: Half the length of its sides, metres.
        height: Metres.
    """

    half_size: float
    height: float


@functools.cache
def candle() -> Candle:
    """The candle of `models/candle.xml`."""
    radius, half_height = _size("candle", "wax")
    return Candle(radius, 2 * half_height)


@functools.cache
def table() -> Box:
    """The table of `models/table.xml`."""
    return _box("table", "top")


@functools.cache
def toy_bin() -> Box:
    """The toy bin of `models/toy_bin.xml`."""
    return _box("toy_bin", "box")


@functools.cache
def toddler_radius() -> float:
    """Radius of the toddler of `models/toddler.xml`, metres."""
    return _size("toddler", "body")[0]


def _box(model: str, geom: str) -> Box:
    half_size, _, half_height = _size(model, geom)
    return Box(half_size, 2 * half_height)


def _size(model: str, geom: str) -> tuple[float, ...]:
    """What a geom of a model says of its size, metres; what it means depends on its type."""
    file = importlib.resources.files("caregiver_mj.models") / f"{model}.xml"
    (found,) = ElementTree.fromstring(file.read_text(encoding="utf-8")).findall(f".//worldbody//geom[@name='{geom}']")
    return tuple(float(number) for number in found.attrib["size"].split())
