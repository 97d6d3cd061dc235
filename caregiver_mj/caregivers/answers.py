"""Record the answers of a caregiver or policy, and replay them without it."""

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

_ASKED = ("prepare", "decide", "destination")  # methods that a world calls
_SUFFIX = ".npy"
_NAMES = {f"{name}{_SUFFIX}" for name in ("actions", "traits", "verbs", *_ASKED)}  # files of the packed arrays
_PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
_KINDS = "bifuU"  # dtype kinds: numbers and names
_MOST_SIDES = 4  # dimensions of an array: answers, their parts, worlds, candles


@contextlib.contextmanager
def kept(caregiver: Caregiver | None) -> Iterator[Callable[[], str]]:
    """Record in this context a caregiver's answers to its world; yield a function that returns them as text."""
    if caregiver is None:
        yield lambda: ""
        return
    own = {question: getattr(caregiver, question) for question in _ASKED}
    given: dict[str, list[np.ndarray]] = {question: [] for question in _ASKED}
    verbs: dict[str, int] = {}
    depth = 0  # of nested calls: only the outermost comes from the world

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
        traits = caregiver.yields, caregiver.takes_orders, caregiver.idle_verb
        arrays: dict[str, Any] = {question: np.array(answers) for question, answers in given.items() if answers}
        return packed(traits=np.array(traits, str), verbs=np.array([*verbs], str), **arrays)

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
    """Return the arrays in a text of answers by name.

    Their stated sizes are checked before any of them is unpacked.

    Raises:
        CaregiverError: The text cannot be read, is too large, or has other arrays.
    """
    if not text:
        return {}
    try:
        with zipfile.ZipFile(io.BytesIO(base64.b64decode(text, validate=True))) as file:
            members = file.infolist()
            if len({member.filename for member in members} & _NAMES) < len(members):
                raise ValueError(f"they must be arrays called {', '.join(sorted(_NAMES))}, each at most once")
            if any(member.compress_type not in _PACKED for member in members):
                raise ValueError("they must be stored or packed by deflation")
            if (size := sum(member.file_size for member in members)) > LARGEST_ARRAYS:
                raise ValueError(f"they must come to at most {LARGEST_ARRAYS:,} bytes, got {size:,}")
            return {member.filename.removesuffix(_SUFFIX): _array(file.read(member)) for member in members}
    except Exception as error:  # an untrusted text may be encrypted, hold no arrays, or exceed memory
        raise CaregiverError(f"the answers of a caregiver cannot be read: {plain(error)}") from None


def _array(content: bytes) -> np.ndarray:
    """Return the array in an .npy file, whose size must agree with its header."""
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
    """Return a caregiver or policy that replays a text of answers; raise CaregiverError if it cannot be read."""
    arrays = unpacked(text)
    return ReplayedPolicy(arrays["actions"]) if "actions" in arrays else ReplayedCaregiver(plan, arrays)


class ReplayedPolicy:
    """Replays actions, (n, actions), and raises CaregiverError after the last."""

    def __init__(self, actions: np.ndarray):
        self._left = iter(actions)

    def __call__(self, timestep: Any) -> np.ndarray:
        """Return the next action."""
        if (action := next(self._left, None)) is None:
            raise CaregiverError("the actions of a policy must last to the end of its episodes")
        return np.array(action)


class ReplayedCaregiver(Caregiver):
    """Replays another caregiver's answers in order, and raises CaregiverError if the world asks for others."""

    waits = True  # the recorded caregiver may have waited in a cell

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
