"""Remote caregivers: they query a server or a chat model for the hazard to protect from."""

from __future__ import annotations

import abc
import asyncio
import base64
import collections
import functools
import hashlib
import importlib.resources
import io
import itertools
import json
import math
import os
import pathlib
import time
import urllib.request
from collections.abc import Sequence
from typing import Any

import numpy as np

from caregiver_mj.caregivers.caregiver import Caregiver
from caregiver_mj.caregivers.instructed import CommandedCaregiver
from caregiver_mj.caregivers.percept import Percept, bare_tables
from caregiver_mj.caregivers.server import (
    API_KEY,
    BASE_URL,
    MODEL_KEY,
    MODELS,
    REAL_TIME,
    BudgetError,
    Queries,
    Server,
    check_address,
    redacted,
    run,
)
from caregiver_mj.children.walk import WALKING_SPEED
from caregiver_mj.errors import CaregiverError, MissingExtraError
from caregiver_mj.outside import parse_json, plain
from caregiver_mj.plans.cell_graph import LEGEND
from caregiver_mj.plans.floor_plan import FloorPlan
from caregiver_mj.plans.hazards import NOTHING

_AT_ONCE = 8  # simultaneous questions, of different episodes
_CELLS = "child_cell", "previous_cell", "caregiver_cell"
_ROWS = "previous_action", "candle_table", "holding", "out_of_reach", "shut", "gone", "clock", "under_way"
_NEWS = "child_cell", "candle_table", "candle_cell", "holding", "out_of_reach", "shut", "gone"
_CAPTIONS = {"eye": "What the robot's camera sees:", "overview": "The house from above, north up:"}
_SCHEMA = {
    "type": "object",
    "properties": {"target": {"type": ["integer", "null"]}, "reason": {"type": "string"}},
    "required": ["target", "reason"],
    "additionalProperties": False,
}
_episodes = itertools.count()


class RemoteCaregiver(CommandedCaregiver, abc.ABC):
    """Queries a remote service, in JSON, whenever children or things have changed since the last question.

    A question has the `house`, an `episode` identifier, `seen` (percepts since the last question, the present one last;
    `moved` marks those after a move of the children), `allowed`, the numbers of hazards to choose from, and, if
    requested, `frames`, PNG in base64 by camera name. An answer has a `target`, one of the allowed hazards or null, and
    optionally a `table` for a carried thing and a `reason`. Any other or late answer is an abstention: nothing is
    protected until the next question. In real time an answer takes effect only after as many simulated seconds as it
    took; until then the previous one holds.

    Attributes:
        address: Address of the service, or name of the model.
        queries: How to query it.
    """

    address = ""
    queries = Queries()

    def __init__(self, plan: FloorPlan, seed: int = 0):
        super().__init__(plan, seed)
        self.queries.check()
        self._timestep = plan.cell_size / WALKING_SPEED if self.queries.thinking == REAL_TIME else math.inf
        self.server()  # errors now, not at the first question
        lying = [plan.free_cells[cell] for cell in plan.floor_cells]
        cells = [*plan.stairwells, *[None] * len(plan.candle_tables), *lying]  # None: given by `candle_table`
        self._house = {
            "name": plan.name,
            "rows": plan.rows,
            "cell_size": plan.cell_size,
            "legend": {symbol: one for symbol, (one, _) in LEGEND.items()},
            "tables": plan.tables,
            "hazards": [
                {"number": i, "kind": str(one.kind), "damage": one.damage, "verb": one.kind.verb, "cell": cell}
                for i, (one, cell) in enumerate(zip(plan.hazards, cells, strict=True))
            ],
        }

    def reset(self, batch: int, seeds: Sequence[int] | None = None, children: int = 1) -> None:
        super().reset(batch, seeds, children)
        number = next(_episodes)
        self._names = [f"{os.getpid()}-{number}-{world}" for world in range(batch)]
        self._asked: list[list[bytes] | None] = [None] * batch
        self._seen: list[list[dict[str, Any]]] = [[] for _ in range(batch)]
        self._tables = np.full(batch, NOTHING)
        self._said, self._due = np.full((2, batch), NOTHING), np.zeros(batch)  # last answers, and when they take effect

    def watch(self, percept: Percept) -> None:
        for world, seen in enumerate(self._seen):
            seen.append(self._describe(percept, world) | {"moved": True})
            self._asked[world] = None

    def choose(self, percept: Percept) -> np.ndarray:
        allowed = self.worth_protecting(percept)
        news = [values for name in _NEWS if (values := getattr(percept, name)) is not None]
        asked = [[values[world].tobytes() for values in news] for world in range(len(allowed))]
        clock = self._clock(percept)
        self._take_in(clock)
        ask = [i for i, now in enumerate(asked) if clock[i] >= self._due[i] and now != self._asked[i]]
        exchanges = run(self._ask_all([self._question(percept, world, allowed[world]) for world in ask]))
        for world, exchange in zip(ask, exchanges, strict=True):
            answer = {} if exchange["abstention"] else exchange["answer"]
            said = answer.get("target"), answer.get("table")
            self._said[:, world] = [NOTHING if value is None else value for value in said]
            self._due[world] = clock[world] + exchange["seconds"] / self._timestep
            self._asked[world] = asked[world]
        self._keep(exchanges)
        self._take_in(clock)
        return super().choose(percept)

    def _clock(self, percept: Percept) -> np.ndarray:
        """Return the novice timesteps since the start, with their fraction, (B,); zeros unless thinking takes time."""
        if percept.clock is None or self._timestep == math.inf:
            return np.zeros(len(self._due))
        left = 1.0 if percept.time_left is None else percept.time_left  # the grid's clock has no fraction
        return np.maximum(percept.clock, np.floor(percept.clock) + 1.0 - left)

    def _take_in(self, clock: np.ndarray) -> None:
        """Apply the answers that have taken effect."""
        self.targets, self._tables = np.where(clock >= self._due, self._said, [self.targets, self._tables])

    def destination(self, percept: Percept, candle: np.ndarray) -> np.ndarray:
        bare = np.column_stack([bare_tables(percept.candle_table, len(self.plan.tables)), np.zeros(len(candle), bool)])
        theirs = bare[np.arange(len(candle)), self._tables]
        return np.where(theirs, self._tables, super().destination(percept, candle))

    def _describe(self, percept: Percept, world: int) -> dict[str, Any]:
        """Return the percept of one world as JSON."""
        cells = self.plan.caregiver_cells
        found: dict[str, Any] = {}
        for name in _CELLS:
            value = getattr(percept, name)[world].tolist()
            found[name] = cells[value] if isinstance(value, int) else [cells[cell] for cell in value]
        for name in _ROWS:
            if (values := getattr(percept, name)) is not None:
                found[name] = values[world].tolist()
        if percept.candle_cell is not None:
            found["candle_cell"] = [None if c == NOTHING else cells[c] for c in percept.candle_cell[world].tolist()]
        if percept.belief is not None:
            found["child_seen"] = percept.belief.seen[world].tolist()
        return found

    def _question(self, percept: Percept, world: int, allowed: np.ndarray) -> dict[str, Any]:
        seen, self._seen[world] = self._seen[world], []
        now = self._describe(percept, world)
        if not (seen and now == seen[-1] | now):  # else unchanged since their last move
            seen.append(now)
        question = {
            "house": self._house,
            "episode": self._names[world],
            "seen": seen,
            "allowed": np.flatnonzero(allowed).tolist(),
        }
        if self.needs_pictures:
            if percept.frames is None:
                raise CaregiverError("frames must be left out where there are no cameras, as in the grid")
            question["frames"] = {camera: _png(picture) for camera, picture in percept.frames().items()}
        return question

    async def _ask_all(self, questions: list[dict[str, Any]]) -> list[dict[str, Any]]:
        at_once, server = asyncio.Semaphore(_AT_ONCE), self.server()

        async def ask(question: dict[str, Any]) -> dict[str, Any]:
            async with at_once:
                return await self._ask(server, question)

        tasks = [asyncio.ensure_future(ask(question)) for question in questions]
        try:
            return await asyncio.gather(*tasks)
        finally:  # if one finds no server, cancel the others
            for task in tasks:
                task.cancel()

    async def _ask(self, server: Server, question: dict[str, Any]) -> dict[str, Any]:
        """Return the exchange: the question, the answer, and the reason of an abstention, or None.

        Raises:
            CaregiverError: No server can be reached.
        """
        start, answer, problem = time.time(), None, None
        keys = [os.environ.get(name, "") for name in (API_KEY, MODEL_KEY)]
        try:
            server.budget.check()
            answer = redacted(await server.in_time(self.send(server, question)), keys)
            problem = self._problem(answer, question["allowed"])
        except BudgetError as error:  # final: no more frames are needed
            problem = str(error)
            self.needs_pictures = False
            question.pop("frames", None)
        except CaregiverError:
            raise
        except Exception as error:  # a malformed answer or a client's own failure
            problem = plain(redacted(f"{type(error).__name__}: {error}", keys))
        return {"question": question, "answer": answer, "abstention": problem, "seconds": time.time() - start}

    def _keep(self, exchanges: list[dict[str, Any]]) -> None:
        """Append exchanges to the log folder, if there is one, with frames as separate files."""
        if self.queries.folder:
            folder = pathlib.Path(self.queries.folder)
            folder.mkdir(parents=True, exist_ok=True)
            for frames in (exchange["question"].get("frames", {}) for exchange in exchanges):
                for camera, text in frames.items():
                    content = base64.b64decode(text)
                    frames[camera] = f"{hashlib.sha256(content).hexdigest()}.png"
                    (folder / frames[camera]).write_bytes(content)
            with open(folder / f"{os.getpid()}.jsonl", "a", encoding="utf-8") as file:
                file.writelines(json.dumps(exchange) + "\n" for exchange in exchanges)

    def _problem(self, answer: Any, allowed: Sequence[int]) -> str | None:
        if not isinstance(answer, dict) or "target" not in answer:
            return f"the answer must be an object with a target, got {plain(answer, 200)}"
        for key, among in (("target", allowed), ("table", range(len(self.plan.tables)))):
            value = answer.get(key)
            if value is not None and (type(value) is not int or value not in among):
                return f"{key} must be one of {list(among)} or null, got {plain(value, 200)}"
        return None

    def server(self) -> Server:
        """Return the server; raise CaregiverError if its address or key is invalid."""
        return _server(self.address, self.queries, os.environ.get(API_KEY, ""))

    @abc.abstractmethod
    async def send(self, server: Server, question: dict[str, Any]) -> Any:
        """Return the raw answer to a question."""


class HttpCaregiver(RemoteCaregiver):
    """Posts questions to an address."""

    async def send(self, server: Server, question: dict[str, Any]) -> Any:
        given = await server.client.post(self.address, json=question)
        return parse_json(given.raise_for_status().content)


class ChatCaregiver(RemoteCaregiver):
    """Queries a chat model through OpenAI's interface, with the key from the environment."""

    def server(self) -> Server:
        where = self.queries.base_url or MODELS
        if where == MODELS and not os.environ.get(MODEL_KEY):
            raise CaregiverError(
                f"chat:{self.address} requires a server, --base-url URL ({BASE_URL}), or a key for {MODELS} in "
                f"{MODEL_KEY}"
            )
        check_address(f"--base-url ({BASE_URL})", where)
        return _server(where, self.queries)

    async def send(self, server: Server, question: dict[str, Any]) -> Any:
        key = os.environ.get(MODEL_KEY) or "none"  # a local server needs none
        client = _chat(server, key)
        form: Any = {"type": "json_schema", "json_schema": {"name": "answer", "strict": True, "schema": _SCHEMA}}
        content: Any = json.dumps({key: value for key, value in question.items() if key != "frames"})
        if "frames" in question:
            content = [{"type": "text", "text": content}]
            for camera, frame in question["frames"].items():
                picture = {"url": f"data:image/png;base64,{frame}"}
                content += [{"type": "text", "text": _CAPTIONS[camera]}, {"type": "image_url", "image_url": picture}]
        given = await client.chat.completions.create(
            model=self.address,
            messages=[{"role": "system", "content": _prompt()}, {"role": "user", "content": content}],
            response_format=form,
        )
        if given.usage:
            server.budget.spend(int(given.usage.total_tokens or 0))
        if not given.choices:
            raise ValueError("the model has given no choice")
        return parse_json(given.choices[0].message.content or "")


def tally(folder: str | os.PathLike[str]) -> str:
    """Return the numbers of questions and abstentions in a log folder, as text."""
    lines = [line for file in pathlib.Path(folder).glob("*.jsonl") for line in file.read_text("utf-8").splitlines()]
    problems = collections.Counter(problem for line in lines if (problem := json.loads(line)["abstention"]))
    most = "".join(f"; {count} x {problem}" for problem, count in problems.most_common(3))
    return f"{len(lines)} questions, {problems.total()} abstentions{most}"


def remote_caregiver(name: str, queries: Queries) -> type[Caregiver]:
    """Return the caregiver for an address, http://..., or a model, chat:NAME.

    Raises:
        MissingExtraError: The client's package is not installed.
        CaregiverError: The address is invalid or holds a secret, or the model has no name.
    """
    scheme, _, rest = name.partition(":")
    if not rest.strip("/"):
        raise CaregiverError(f"a caregiver must be http://ADDRESS or chat:MODEL, got '{name}'")
    try:
        if scheme != "chat":
            check_address("a caregiver", name)
        import openai  # noqa: F401
    except ImportError as error:
        raise MissingExtraError(f"caregiver '{name}' needs {error.name}: pip install 'caregiver_mj[chat]'") from None
    kind: type[RemoteCaregiver] = ChatCaregiver if scheme == "chat" else HttpCaregiver
    traits = {"address": rest if scheme == "chat" else name, "needs_pictures": queries.frames}
    return type(kind.__name__, (kind,), {**traits, "queries": queries.for_caregivers([name]), "__module__": __name__})


def _png(picture: np.ndarray) -> str:
    """Return an image (height, width, 3) as PNG in base64."""
    from PIL import Image  # imported where used

    file = io.BytesIO()
    Image.fromarray(picture).save(file, "PNG")
    return base64.b64encode(file.getvalue()).decode()


@functools.lru_cache(maxsize=1)
def _prompt() -> str:
    return (importlib.resources.files(__package__) / "prompt.md").read_text("utf-8")


def _server(address: str, queries: Queries, key: str = "") -> Server:
    proxies = tuple(sorted(urllib.request.getproxies().items()))
    return _server_of(address, queries.patience, queries.budget, key, proxies, os.getpid())


# Cached with its connections, by proxies, key and process.
_server_of = functools.lru_cache(maxsize=8)(lambda *which: Server(*which[:4]))


@functools.lru_cache(maxsize=8)
def _chat(server: Server, key: str) -> Any:
    import openai

    return openai.AsyncOpenAI(
        base_url=server.address, api_key=key, http_client=server.client, timeout=server.timeout, max_retries=1
    )
