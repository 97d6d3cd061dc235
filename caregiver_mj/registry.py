"""Registries of named classes: the package's own, and entry points of installed packages."""

from __future__ import annotations

import contextlib
import importlib
import importlib.metadata
import inspect
import os
import sys
import traceback
import warnings
from collections.abc import Iterator, Mapping
from typing import Any, Generic, TypeVar

from caregiver_mj.errors import CaregiverError

Kind = TypeVar("Kind")


class Registry(Mapping[str, Kind], Generic[Kind]):
    """Classes by name, or by `module:object`.

    Entry points are looked up at each use, and loaded on request.
    """

    def __init__(self, what: str, group: str, base: str, own: Mapping[str, Kind]):
        """Prepare a registry.

        Args:
            what: Name of the registered things in messages, such as "caregiver".
            group: Entry-point group of other packages.
            base: Full name of the required base class.
            own: The package's own classes, which come first and cannot be replaced.
        """
        self.what, self.group = what, group
        self._base, self._own = base, own
        self._warned: set[str] = set()  # names with a warning about unused entry points

    def __getitem__(self, name: str) -> Kind:
        if name in self._own:
            self.tell_of_namesakes(name, f"{self.what} '{name}' is one of the package's own")
            return self._own[name]
        if name not in self and ":" in name:
            found = named_object(name)
            self.check(name, "yours", found)
            return found
        if name not in self:
            raise CaregiverError(f"no {self.what} '{name}': there are {', '.join(self)}, and yours as module:object")
        entry, *others = self._offered(name)
        if any(other.value != entry.value for other in others):
            values = ", ".join(offered.value for offered in (entry, *others))
            raise CaregiverError(f"{self.what} '{name}' must be offered by one package, got {values}")
        try:
            found = entry.load()
        except (Exception, SystemExit) as error:  # raised by a foreign module
            raise CaregiverError(f"{self.what} '{name}' ({entry.value}) cannot be loaded: {error}") from error
        self.check(name, entry.value, found)
        return found

    def describe(self, name: str) -> str:
        """Return a line about a name: a summary with the package that offers it, or the name that it is an alias of.

        Raises:
            CaregiverError: The name is unknown, or cannot be loaded.
        """
        found = self[name]
        if name in self._own:
            first = next(other for other, own in self._own.items() if own is found)
            return summary(found) if first == name else f"Alias of {first}."
        package = self._offered(name)[0].dist
        return f"{summary(found)} (from {package.name if package else self._offered(name)[0].value})".lstrip()

    def _offered(self, name: str) -> list[importlib.metadata.EntryPoint]:
        return [entry for entry in importlib.metadata.entry_points(group=self.group) if entry.name == name]

    def tell_of_namesakes(self, name: str, why: str) -> None:
        """Warn once that entry points with a name are unused, and why."""
        if name not in self._warned:
            self._warned.add(name)
            for entry in self._offered(name):
                warnings.warn(f"entry point {entry.value} is not used: {why}", stacklevel=3)

    def check(self, name: str, value: str, found: Any) -> None:
        """Raise CaregiverError unless an object found under a name, with the `value` of its entry point, is valid."""
        if not (isinstance(found, type) and any(_name(base) == self._base for base in found.__mro__)):
            raise CaregiverError(f"{self.what} '{name}' ({value}) must be a subclass of {self._base}, got {found!r}")
        _check_whole(f"{self.what} '{name}'", found)

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in list(self)  # without loading it

    def __iter__(self) -> Iterator[str]:
        offered = importlib.metadata.entry_points(group=self.group).names
        return iter([*self._own, *sorted(set(offered) - set(self._own))])

    def __len__(self) -> int:
        return len(list(iter(self)))


def summary(found: object) -> str:
    """Return the first line of an object's docstring, or ""."""
    return inspect.cleandoc(getattr(found, "__doc__", None) or "").partition("\n")[0]


@contextlib.contextmanager
def modules_of_the_folder() -> Iterator[None]:
    """Append the working directory to the import path, for names such as `module:object`."""
    before = list(sys.path)
    with contextlib.suppress(FileNotFoundError):  # the folder may be gone
        sys.path.append(os.getcwd())
    try:
        yield
    finally:
        sys.path[:] = before


@contextlib.contextmanager
def environment(name: str, value: str) -> Iterator[None]:
    """Set an environment variable in this context."""
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        del os.environ[name]
        if before is not None:
            os.environ[name] = before


def named_object(name: str) -> Any:
    """Load a `module:object`.

    Raises:
        CaregiverError: The module is missing or fails, or has no such object.
    """
    entry = importlib.metadata.EntryPoint(name, name, "")
    if entry.pattern.match(name) is None or entry.extras:
        raise CaregiverError(f"a name must be module:object, got '{name}'")
    try:
        return entry.load()
    except (Exception, SystemExit) as error:  # raised by a foreign module
        file = getattr(sys.modules.get(entry.module), "__file__", None)  # perhaps another one than intended
        found = f" (the module is '{file}')" if file and isinstance(error, AttributeError) else ""
        raise CaregiverError(f"'{name}' cannot be loaded: {type(error).__name__}: {error}{found}") from error


def check_call(what: str, found: Any, *given: Any) -> None:
    """Raise CaregiverError if a class or function cannot be called with the given arguments."""
    _check_whole(what, found)
    try:
        inspect.signature(found).bind(*given)
    except TypeError as error:
        kinds = ", ".join(type(value).__name__ for value in given)
        raise CaregiverError(f"{what} cannot be called with ({kinds}): {error}") from None
    except ValueError:  # without a signature
        pass


@contextlib.contextmanager
def errors_of(what: str, where: str, but: type[Exception] = CaregiverError) -> Iterator[None]:
    """Turn exceptions of foreign code, other than `CaregiverError` and `but`, into a CaregiverError with their place.

    Raises:
        CaregiverError: The code raised another exception, which is its cause.
    """
    try:
        yield
    except (CaregiverError, but):
        raise
    except Exception as error:
        problem = f"{type(error).__name__}: {' '.join(str(error).split())}"
        last = traceback.extract_tb(error.__traceback__)[-1]
        raise CaregiverError(f"{what} failed {where}: {problem} ({last.filename}, line {last.lineno})") from error


def _check_whole(what: str, found: Any) -> None:
    """Raise CaregiverError for a class with abstract methods."""
    if inspect.isabstract(found):
        raise CaregiverError(f"{what} must have {', '.join(sorted(found.__abstractmethods__))}, got none")


def _name(found: type) -> str:
    return f"{found.__module__}.{found.__qualname__}"
