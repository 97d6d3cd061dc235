"""What a caregiver, or a policy, has answered in some episodes: kept with their rows, and given again without it."""

from __future__ import annotations

import base64
import contextlib
import functools
import io
import math
import zipfile
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.percept import Percept
from caregiver_mj.errors import CaregiverError
from caregiver_mj.interventions.verb import Interventions
from caregiver_mj.outside import LARGEST_ARRAYS, MOST_NUMBERS, plain
from caregiver_mj.plans.floor_plan import FloorPlan

_ASKED = ("prepare", "decide", "destination")  # by its world
_SUFFIX = ".npy"
_NAMES = {f"{name}{_SUFFIX}" for name in ("actions", "traits", "verbs", *_ASKED)}  # of arrays, as they are packed
_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_KINDS = "bifuU"  # of what is in them: numbers and names
_MOST_SIDES = 4  # of an array: answers, what they are of, worlds, candles


@contextlib.contextmanager
def kept(caregiver: Caregiver | None) -> Iterator[Callable[[], str]]:
    """Keep, within, what a caregiver answers its world; give a function that returns it as text, for a replay."""
    own = {question: getattr(caregiver, question) for question in _ASKED if caregiver}
    given: dict[str, list[np.ndarray]] = {question: [] for question in _ASKED}
    verbs: dict[str, int] = {}
    depth = 0  # of questions: one that it asks itself is none of its world's

    def ask(question: str, *arguments: Any) -> Any:
        nonlocal depth
        depth += 1
        try:
            answer = own[question](*arguments)
        finally:
            depth -= 1
        if depth == 0:
            parts = answer
            if isinstance(answer, Interventions):
                names = np.asarray(answer.verb).tolist()
                parts = [verbs.setdefault(verb, len(verbs)) for verb in names], answer.hazard, answer.destination
            given[question].append(np.array(parts, np.int32))
        return answer

    def text() -> str:
        if caregiver is None:
            return ""
        traits = caregiver.yields, caregiver.takes_orders, caregiver.idle_verb
        arrays: dict[str, Any] = {question: np.array(answers) for question, answers in given.items() if answers}
        return packed(traits=np.array(traits, str), verbs=np.array([*verbs], str), **arrays)

    if caregiver is None:
        yield text
        return
    before = dict(vars(caregiver))
    vars(caregiver).update({question: functools.partial(ask, question) for question in _ASKED})
    try:
        yield text
    finally:
        for question in _ASKED:
            del vars(caregiver)[question]
        vars(caregiver).update({question: before[question] for question in _ASKED if question in before})


def packed(**arrays: np.ndarray) -> str:
    """Return arrays as text, for `unpacked`."""
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)  # type: ignore[arg-type]  # no array is called `allow_pickle`
    return base64.b64encode(content.getvalue()).decode()


def unpacked(text: str) -> dict[str, np.ndarray]:
    """Return the arrays in a text of answers by name, none of them of a single number.

    What they come to is known, and refused if it is too much, before any of them is unpacked.

    Raises:
        CaregiverError: It cannot be read, or has more than the answers of a caregiver.
    """
    if not text:
        return {}
    try:
        with zipfile.ZipFile(io.BytesIO(base64.b64decode(text, validate=True))) as file:
            members = file.infolist()
            if len({member.filename for member in members} & _NAMES) < len(members):
                raise ValueError(f"they must be arrays called {', '.join(sorted(_NAMES))}, each at most once")
            if any(member.compress_type not in _PACKED for member in members):
                raise ValueError("they must be packed by deflation, which tells what it comes to")
            if (size := sum(member.file_size for member in members)) > LARGEST_ARRAYS:
                raise ValueError(f"they must come to at most {LARGEST_ARRAYS:,} bytes, got {size:,}")
            return {member.filename.removesuffix(_SUFFIX): _array(file.read(member)) for member in members}
    except Exception as error:  # a text from anybody: encrypted, no arrays, larger than memory
        raise CaregiverError(f"the answers of a caregiver cannot be read: {plain(error)}") from None


def _array(content: bytes) -> np.ndarray:
    """Return the array in a file of NumPy's, whose bytes are no more and no fewer than its header says."""
    file = io.BytesIO(content)
    version = np.lib.format.read_magic(file)
    if version != (1, 0):
        raise ValueError(f"an array must be of version 1.0 of its format, got {version}")
    shape, _, dtype = np.lib.format.read_array_header_1_0(file)
    numbers = math.prod(max(1, side) for side in shape)
    if dtype.kind not in _KINDS or not 1 <= len(shape) <= _MOST_SIDES or numbers > MOST_NUMBERS:
        raise ValueError(f"an array must have at most {MOST_NUMBERS:,} numbers or names, got {dtype}, {shape}")
    if math.prod(shape) * dtype.itemsize != len(content) - file.tell():
        raise ValueError(f"an array of {dtype}, {shape}, must have as many bytes, got {len(content) - file.tell():,}")
    file.seek(0)
    return np.lib.format.read_array(file, allow_pickle=False)


def replayed(plan: FloorPlan, text: str) -> ReplayedCaregiver | ReplayedPolicy:
    """Return what gives the answers in a text again; where they cannot be read, that is a `CaregiverError`."""
    arrays = unpacked(text)
    return ReplayedPolicy(arrays["actions"]) if "actions" in arrays else ReplayedCaregiver(plan, arrays)


class ReplayedPolicy:
    """Gives actions again, (n, actions); a `CaregiverError` where there are no more, or they are none."""

    def __init__(self, actions: np.ndarray):
        self._left = iter(actions)

    def __call__(self, timestep: Any) -> np.ndarray:
        """Answer a time step with the next one."""
        if (action := next(self._left, None)) is None:
            raise CaregiverError("the actions of a policy must last to the end of its episodes")
        return np.array(action)


class ReplayedCaregiver(Caregiver):
    """Gives the answers that another one has given, in their order, to a world that asks for the same.

    Where they cannot be read, or its world asks for others, that is a `CaregiverError`.
    """

    waits = True  # the caregiver that gave the answers may have waited in a cell

    def __init__(self, plan: FloorPlan, arrays: dict[str, np.ndarray]):
        super().__init__(plan)
        try:
            yields, takes_orders, self._idle = arrays["traits"].tolist()
            self._verbs = np.array([*arrays["verbs"].tolist(), None], object)
        except (KeyError, ValueError):
            raise CaregiverError(
                f"the answers of a caregiver must have its traits and verbs, got {[*arrays]}"
            ) from None
        self._left: dict[str, Iterator[Any]] = {question: iter(arrays.get(question, ())) for question in _ASKED}
        self.yields, self.takes_orders = yields == "True", takes_orders == "True"

    @property
    def idle_verb(self) -> str:
        return str(self._idle)

    def _next(self, question: str, shape: tuple[int, ...]) -> np.ndarray:
        found = np.asarray(next(self._left[question], ()))
        if found.shape != shape or not np.issubdtype(found.dtype, np.integer):
            raise CaregiverError(f"the next answer to '{question}' must be integers of shape {shape}, got {found}")
        return found.astype(int)

    def prepare(self, candle_table: np.ndarray) -> np.ndarray:
        return self._next("prepare", candle_table.shape)

    def choose(self, percept: Percept) -> np.ndarray:
        return self.decide(percept).hazard

    def decide(self, percept: Percept) -> Interventions:
        verb, hazard, destination = self._next("decide", (3, len(percept.child_cell)))
        return Interventions(self._verbs[np.clip(verb, -1, len(self._verbs) - 1)], hazard, destination)

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        return self._next("destination", candle.shape)
