"""Things by name: the package's own, and those that installed packages offer as entry points."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterator, Mapping
from typing import Any, Generic, TypeVar

from caregiver_mj.errors import CaregiverError

Kind = TypeVar("Kind")


class Registry(Mapping[str, "Kind | None"], Generic[Kind]):
    """Classes by name. Entry points are looked up at each use and not at import, and loaded when they are asked for."""

    def __init__(self, what: str, group: str, base: str, own: Mapping[str, Kind | None]):
        """Prepares a registry.

        Args:
            what: What is registered, in messages: "caregiver".
            group: The entry-point group in which other packages offer theirs.
            base: Full name of the class that all must be subclasses of.
            own: The package's own, which come first and cannot be replaced.
        """
        self.what, self.group = what, group
        self._base, self._own = base, own

    def __getitem__(self, name: str) -> Kind | None:
        if name in self._own:
            return self._own[name]
        if name not in self:
            raise CaregiverError(f"no {self.what} '{name}': there are {', '.join(self)}")
        entry = importlib.metadata.entry_points(group=self.group)[name]
        try:
            found = entry.load()
        except Exception as error:  # whatever somebody else's module raises
            raise CaregiverError(f"{self.what} '{name}' ({entry.value}) cannot be loaded: {error}") from error
        self.check(name, entry.value, found)
        return found

    def check(self, name: str, value: str, found: Any) -> None:
        """Raises CaregiverError unless what an entry point (a name and its value) has led to can be used."""
        if not (isinstance(found, type) and any(_name(base) == self._base for base in found.__mro__)):
            raise CaregiverError(f"{self.what} '{name}' ({value}) is not a subclass of {self._base}")

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in list(self)  # without loading it

    def __iter__(self) -> Iterator[str]:
        offered = importlib.metadata.entry_points(group=self.group).names
        return iter([*self._own, *sorted(set(offered) - set(self._own))])

    def __len__(self) -> int:
        return len(list(iter(self)))


def _name(found: type) -> str:
    return f"{found.__module__}.{found.__qualname__}"
