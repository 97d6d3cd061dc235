"""Requests to a server: how it is asked, one deadline a question, answers of bounded size, and a budget for a run."""

from __future__ import annotations

import asyncio
import dataclasses
import functools
import ipaddress
import math
import os
import pathlib
import re
import tempfile
import threading
from collections.abc import AsyncIterator, Coroutine, Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar
from urllib.parse import urlsplit

from caregiver_mj.errors import CaregiverError, check_integer, check_kind, check_number

if TYPE_CHECKING:
    import httpx2 as httpx

Answer = TypeVar("Answer")
SCHEMES = "http:", "https:", "chat:"  # of the names of caregivers that ask
# Variables of the environment: keys, of servers and of models; and the address of models, as OpenAI's client takes it.
API_KEY, MODEL_KEY, BASE_URL = "CAREGIVER_MJ_API_KEY", "OPENAI_API_KEY", "OPENAI_BASE_URL"
MODELS = "https://api.openai.com/v1"  # where models are if nobody says
WAITS, REAL_TIME = "waits", "real-time"
LARGEST = 1_000_000  # bytes of an answer
_MOST_PATIENCE = 86_400.0  # seconds, a day
_CONNECTING = 1 / 3  # share of the time for an answer in which a connection must be made: there are two attempts
_SHORTEST_KEY = 6  # characters; a shorter one protects nothing, and is a part of other words
_REMOVED = "[key]"
_ESCAPE = re.compile(r"\\u([0-9a-fA-F]{4})")


def check_no_secret(what: str, address: str) -> None:
    """Raise CaregiverError if an address may hold a secret: it is printed and stored."""
    if any(mark in address for mark in "@?#"):
        where = re.split("[?#]", address[address.rfind("@") + 1 :])[0]
        raise CaregiverError(
            f"{what} must be an address without user, password, query and fragment, for it is printed and stored, "
            f"got one at '{where[:200]}': put a key into CAREGIVER_MJ_API_KEY, or OPENAI_API_KEY for chat:MODEL"
        )


def check_address(what: str, address: str) -> None:
    """Raise CaregiverError unless it is the address of a server, and holds no secret."""
    check_no_secret(what, address)
    import httpx2 as httpx

    where = address[:200]
    try:
        parts, port = urlsplit(address), httpx.URL(address).port
        whole = parts.scheme in ("http", "https") and bool(parts.hostname) and port in (None, parts.port)
    except (ValueError, httpx.InvalidURL):
        whole = False
    if not whole or not address.isprintable() or " " in address:
        raise CaregiverError(f"{what} must be an address such as http://127.0.0.1:8000, got {where!r}")


@dataclasses.dataclass(frozen=True)
class Queries:
    """How servers and models are asked in a run, and within which budget. Keys alone are left to the environment."""

    base_url: str = ""  #: where models are; "" for OPENAI_BASE_URL, or OpenAI's own
    max_calls: int | None = None  #: requests of the run, over its processes and when it is resumed; None for any number
    max_tokens: int | None = None  #: tokens of models, counted so too; no more are asked once they are used up
    patience: float = 30.0  #: seconds for an answer
    thinking: str = WAITS  #: whether simulated time `WAITS` for an answer, or goes on until it comes: `REAL_TIME`
    frames: bool = False  #: whether questions have pictures of the house
    folder: str = ""  #: where exchanges are kept and the budget is counted; no answer depends on it

    def check(self) -> None:
        """Raise CaregiverError unless somebody can be asked so."""
        for name in ("max_calls", "max_tokens"):
            if (most := getattr(self, name)) is not None:
                check_integer(name, most, 0)
        check_number("patience, in seconds,", self.patience, 0, _MOST_PATIENCE)
        if self.thinking not in (WAITS, REAL_TIME):
            raise CaregiverError(f"thinking must be {WAITS} or {REAL_TIME}, got '{self.thinking}'")
        for name, kind in (("frames", bool), ("base_url", str), ("folder", str)):
            check_kind(name, getattr(self, name), kind)
        check_no_secret(f"base_url, or {BASE_URL} of the environment,", self.base_url)

    def for_caregivers(self, names: Iterable[str]) -> Queries:
        """Return these as far as caregivers of some names depend on them.

        If one is a model and there is no address of models, it is the environment's, as for OpenAI's client, or else
        OpenAI's own. It is then said, so that a process with another environment asks the same models.
        """
        asks = [name for name in names if name.startswith(SCHEMES)]
        if not asks:
            return Queries()
        models = any(name.startswith("chat:") for name in asks)
        return dataclasses.replace(
            self, base_url=(self.base_url or os.environ.get(BASE_URL) or MODELS) if models else ""
        )

    def record(self) -> dict[str, Any]:
        """Return all that answers depend on, as JSON.

        Raises:
            CaregiverError: The address may hold a secret.
        """
        check_no_secret(f"base_url, or {BASE_URL} of the environment,", self.base_url)
        return {name: value for name, value in vars(self).items() if name != "folder"}

    @property
    def is_limited(self) -> bool:
        """Whether requests are counted."""
        return self.max_calls is not None or self.max_tokens is not None

    @property
    def budget(self) -> Budget:
        """What counts the requests."""
        calls, tokens = (math.inf if most is None else most for most in (self.max_calls, self.max_tokens))
        return Budget(self.folder or None, calls, tokens)


class BudgetError(Exception):
    """No more requests may be sent."""


@dataclasses.dataclass(frozen=True)
class Budget:
    """Counts the requests and tokens of a run, over its processes and when it is resumed, in files of a folder.

    A request is a byte that is appended to the file `calls`, which a file system does for one process after the other:
    its place is the request's number. Each line of the file `tokens` has those of one answer.
    """

    folder: str | None = None  # where the files are; if None, in a folder of this process
    calls: float = math.inf  # how many requests there may be
    tokens: float = math.inf  # after how many tokens there are no more

    def check(self) -> None:
        """Raise BudgetError if it is used up."""
        if self.calls < math.inf and self._size() >= self.calls:
            raise BudgetError(f"the budget of {self.calls:g} calls is used up")
        if self.tokens < math.inf and self._spent() >= self.tokens:
            raise BudgetError(f"the budget of {self.tokens:g} tokens is used up")

    def take(self) -> None:
        """Count a request that is about to be sent; raise BudgetError if it may not be."""
        self.check()
        if self._append("calls", b".") > self.calls:  # another process has taken the last one since
            raise BudgetError(f"the budget of {self.calls:g} calls is used up")

    def spend(self, tokens: int) -> None:
        """Count the tokens of an answer."""
        self._append("tokens", b"%d\n" % max(0, tokens))

    def _file(self, name: str) -> pathlib.Path:
        return pathlib.Path(self.folder or _folder_of_this_process().name, name)

    def _size(self) -> int:
        file = self._file("calls")
        return file.stat().st_size if file.exists() else 0

    def _spent(self) -> int:
        file = self._file("tokens")
        try:
            return sum(map(int, file.read_bytes().split())) if file.exists() else 0
        except ValueError:
            raise CaregiverError(f"'{file}' must be numbers of tokens, a line each: take another folder") from None

    def _append(self, name: str, content: bytes) -> int:
        """Append to a file; return the bytes from its beginning to the end of what was written."""
        file = self._file(name)
        file.parent.mkdir(parents=True, exist_ok=True)  # also on another machine
        with open(file, "ab", buffering=0) as opened:
            opened.write(content)
            return opened.tell()


@functools.cache
def _folder_of_this_process() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="caregiver_mj-")


def redacted(value: Any, keys: Sequence[str]) -> Any:
    """Return a JSON value without keys in it, also where JSON escapes are in them."""
    if isinstance(value, str):
        for key in (key for key in keys if len(key) >= _SHORTEST_KEY):
            value = value.replace(key, _REMOVED)
            if key in _ESCAPE.sub(lambda found: chr(int(found[1], 16)), value).replace("\\/", "/"):
                return _REMOVED
        return value
    if isinstance(value, list):
        return [redacted(one, keys) for one in value]
    if isinstance(value, dict):
        return {redacted(name, keys): redacted(one, keys) for name, one in value.items()}
    return value


def run(asked: Coroutine[Any, Any, Answer]) -> Answer:
    """Run what asks servers, in the thread that does so for this process: another may have a loop of its own."""
    future = asyncio.run_coroutine_threadsafe(asked, _loop(os.getpid()))
    try:
        return future.result()
    except BaseException:  # such as Ctrl-C
        future.cancel()
        raise


@functools.cache
def _loop(_process: int) -> asyncio.AbstractEventLoop:
    loop = asyncio.new_event_loop()
    threading.Thread(target=loop.run_forever, daemon=True, name="caregiver_mj-servers").start()
    return loop


class Server:
    """A server that is asked.

    Attributes:
        address: Where it is.
        client: What requests are sent with, those of others too. Proxies of the environment are used, but not to this
            machine; redirects are not followed. It counts every request.
        budget: What it counts them in.
    """

    def __init__(self, address: str, patience: float, budget: Budget, key: str = ""):
        """Prepare to ask, with `patience` seconds for an answer; a key is sent as a bearer token.

        Raises:
            CaregiverError: The proxies of the environment cannot be used.
        """
        import httpx2 as httpx

        self.address, self.budget = address, budget
        self._patience, self._reached = patience, False
        headers = {"Accept-Encoding": "identity"} | ({"Authorization": f"Bearer {key}"} if key else {})
        host = urlsplit(address).hostname or ""
        direct = {f"all://[{host}]" if ":" in host else f"all://{host}": None} if _is_this_machine(host) else {}
        try:
            self.client = httpx.AsyncClient(
                headers=headers,
                timeout=self.timeout,
                mounts=direct,
                event_hooks={"request": [self._count], "response": [self._admit]},
            )
        except (ValueError, ImportError, httpx.InvalidURL) as error:
            raise CaregiverError(f"proxies of the environment (HTTP_PROXY) cannot be used: {error}") from None

    @property
    def timeout(self) -> httpx.Timeout:
        """That of a connection; the rest is the deadline's."""
        import httpx2 as httpx

        return httpx.Timeout(None, connect=_CONNECTING * self._patience)

    async def in_time(self, asked: Coroutine[Any, Any, Answer]) -> Answer:
        """Wait for what asks the server: all of it, with every wait and further attempt, has one deadline.

        Raises:
            CaregiverError: It cannot be connected to, and never was.
            TimeoutError: There is no whole answer.
            Exception: As of what asks.
        """
        import httpx2 as httpx

        try:
            async with asyncio.timeout(self._patience):
                return await asked
        except TimeoutError:
            raise TimeoutError(f"no whole answer within {self._patience:g} s") from None
        except Exception as error:
            cause = _first(error)
            if not self._reached and isinstance(cause, httpx.ConnectError | httpx.ConnectTimeout | httpx.ProxyError):
                why = str(cause) or f"no connection within {_CONNECTING * self._patience:g} s"
                raise CaregiverError(f"no server can be reached at {self.address}: {why}") from None
            raise

    async def _count(self, request: httpx.Request) -> None:
        self.budget.take()

    async def _admit(self, response: httpx.Response) -> None:
        """Refuse a compressed answer, for a small one may be of any size; let no more than the largest through."""
        import httpx2 as httpx

        self._reached = True
        if (encoding := response.headers.get("Content-Encoding", "identity").strip().lower()) not in ("", "identity"):
            raise httpx.DecodingError(f"the answer must not be compressed, got {encoding[:40]}")

        class Bounded(httpx.AsyncByteStream):
            def __init__(self, stream: Any):
                self._stream = stream

            async def __aiter__(self) -> AsyncIterator[bytes]:
                size = 0
                async for part in self._stream:
                    size += len(part)
                    if size > LARGEST:
                        raise httpx.ReadError(f"the answer must have at most {LARGEST:,} bytes")
                    yield part

            async def aclose(self) -> None:
                await self._stream.aclose()

        response.stream = Bounded(response.stream)


def _first(error: BaseException) -> BaseException:
    """Return the first of the causes of an exception that is one of the connection: clients hide theirs."""
    import httpx2 as httpx

    while not isinstance(error, httpx.HTTPError) and error.__cause__:
        error = error.__cause__
    return error


def _is_this_machine(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
