"""Requests to a server, with a deadline for each question, a size limit for answers, and a budget for a run."""

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
SCHEMES = "http:", "https:", "chat:"  # prefixes of the names of remote caregivers
# Environment variables: keys of servers and of models, and the address of models, as for OpenAI's client.
API_KEY, MODEL_KEY, BASE_URL = "CAREGIVER_MJ_API_KEY", "OPENAI_API_KEY", "OPENAI_BASE_URL"
MODELS = "https://api.openai.com/v1"  # default address of models
WAITS, REAL_TIME = "waits", "real-time"
LARGEST = 1_000_000  # bytes of an answer
_MOST_PATIENCE = 86_400.0  # s; a day
_CONNECTING = 1 / 3  # share of the patience for a connection, which permits two attempts
_SHORTEST_KEY = 6  # characters; shorter keys are not redacted, because they occur in other words
_REMOVED = "[key]"
_ESCAPE = re.compile(r"\\u([0-9a-fA-F]{4})")


def check_no_secret(what: str, address: str) -> None:
    """Raise CaregiverError if an address, which is printed and stored, may hold a secret."""
    if any(mark in address for mark in "@?#"):
        where = re.split("[?#]", address[address.rfind("@") + 1 :])[0]
        raise CaregiverError(
            f"{what} must be an address without user, password, query and fragment, for it is printed and stored, "
            f"got one at '{where[:200]}': put a key into CAREGIVER_MJ_API_KEY, or OPENAI_API_KEY for chat:MODEL"
        )


def check_address(what: str, address: str) -> None:
    """Raise CaregiverError unless an address is that of a server, without a secret."""
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
    """Settings of remote queries in a run, except keys, which stay in the environment."""

    base_url: str = ""  #: address of models; "" for OPENAI_BASE_URL, or OpenAI's
    max_calls: int | None = None  #: greatest number of requests of the run, over all processes and resumptions
    max_tokens: int | None = None  #: tokens of models after which the run sends no more requests
    patience: float = 30.0  #: s; deadline of an answer
    thinking: str = WAITS  #: whether simulated time `WAITS` for an answer, or continues: `REAL_TIME`
    frames: bool = False  #: whether questions include images of the house
    folder: str = ""  #: folder of the log and the budget's counts; no answer depends on it

    def check(self) -> None:
        """Raise CaregiverError unless all values are valid."""
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
        """Return the settings that the named caregivers depend on.

        If one is a model and `base_url` is empty, it becomes that of the environment, or OpenAI's, so that processes
        with another environment query the same models.
        """
        asks = [name for name in names if name.startswith(SCHEMES)]
        if not asks:
            return Queries()
        models = any(name.startswith("chat:") for name in asks)
        return dataclasses.replace(
            self, base_url=(self.base_url or os.environ.get(BASE_URL) or MODELS) if models else ""
        )

    def record(self) -> dict[str, Any]:
        """Return the settings that answers depend on, as JSON; raise CaregiverError if they may hold a secret."""
        check_no_secret(f"base_url, or {BASE_URL} of the environment,", self.base_url)
        return {name: value for name, value in vars(self).items() if name != "folder"}

    @property
    def is_limited(self) -> bool:
        """Whether requests are counted."""
        return self.max_calls is not None or self.max_tokens is not None

    @property
    def budget(self) -> Budget:
        """The counter of requests."""
        calls, tokens = (math.inf if most is None else most for most in (self.max_calls, self.max_tokens))
        return Budget(self.folder or None, calls, tokens)


class BudgetError(Exception):
    """No more requests may be sent."""


@dataclasses.dataclass(frozen=True)
class Budget:
    """Counts the requests and tokens of a run, over its processes and resumptions, in files of a folder.

    Each request appends a byte to the file `calls`; appending is atomic, so its offset is the request's number. Each
    answer appends a line with its tokens to the file `tokens`.
    """

    folder: str | None = None  # folder of the files; None for a temporary one of this process
    calls: float = math.inf  # greatest number of requests
    tokens: float = math.inf  # tokens after which there are no more requests

    def check(self) -> None:
        """Raise BudgetError if the budget is used up."""
        if self.calls < math.inf and self._size() >= self.calls:
            raise BudgetError(f"the budget of {self.calls:g} calls is used up")
        if self.tokens < math.inf and self._spent() >= self.tokens:
            raise BudgetError(f"the budget of {self.tokens:g} tokens is used up")

    def take(self) -> None:
        """Count a request before it is sent; raise BudgetError if the budget is used up."""
        self.check()
        if self._append("calls", b".") > self.calls:  # meanwhile another process took the last one
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
        """Append to a file; return its size afterwards."""
        file = self._file(name)
        file.parent.mkdir(parents=True, exist_ok=True)  # also on another machine
        with open(file, "ab", buffering=0) as opened:
            opened.write(content)
            return opened.tell()


@functools.cache
def _folder_of_this_process() -> tempfile.TemporaryDirectory[str]:
    return tempfile.TemporaryDirectory(prefix="caregiver_mj-")


def redacted(value: Any, keys: Sequence[str]) -> Any:
    """Return a JSON value with all keys removed, including JSON-escaped ones."""
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
    """Run a coroutine in this process's thread for servers: the calling thread may have a running loop."""
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
    """A client of a server.

    Attributes:
        address: Address of the server.
        client: HTTP client, which counts every request. It uses the environment's proxies except for this machine, and
            follows no redirects.
        budget: The counter of requests.
    """

    def __init__(self, address: str, patience: float, budget: Budget, key: str = ""):
        """Make a client with `patience` seconds for an answer; a key is sent as a bearer token.

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
        """Timeout of a connection; `in_time` limits the rest."""
        import httpx2 as httpx

        return httpx.Timeout(None, connect=_CONNECTING * self._patience)

    async def in_time(self, asked: Coroutine[Any, Any, Answer]) -> Answer:
        """Await a request with one deadline for all its waits and attempts.

        Raises:
            CaregiverError: The server cannot be reached, and never was.
            TimeoutError: There is no complete answer in time.
            Exception: Raised by the request.
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
        """Refuse a compressed answer, whose size is unknown, and enforce the size limit."""
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
    """Return the first HTTP error among the causes of an exception: clients wrap theirs."""
    import httpx2 as httpx

    while not isinstance(error, httpx.HTTPError) and error.__cause__:
        error = error.__cause__
    return error


def _is_this_machine(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
