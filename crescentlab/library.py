"""Finds component and fluid classes: installed libraries by entry point, user files by path.

A class's name in a circuit file is its name in snake_case. A user's ``.py`` file is imported only
when a circuit names it in ``library:``, and never under ``--no-code``.
"""

from __future__ import annotations

import importlib
import importlib.metadata
import importlib.util
import inspect
import pkgutil
import sys
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType

from crescentlab.component import Component, snake_case
from crescentlab.errors import ComponentError, InputError, Place, nearest
from crescentlab.fluid import Fluid

GROUP = "crescentlab.components"
"""Entry-point group: each entry is a module or package whose classes join the library."""


@dataclass(frozen=True)
class Library:
    """Component and fluid classes by their name in circuit files."""

    components: dict[str, type[Component]]
    fluids: dict[str, type[Fluid]]

    def component(self, name: str, place: Place | None = None) -> type[Component]:
        """The class called ``name``; raises :class:`InputError` offering the nearest."""
        if name not in self.components:
            hint = nearest(name, self.components)
            if name in self.fluids:
                hint = "it is a fluid; name it under fluid:"
            raise InputError(f"unknown component type {name!r}: {hint}", place)
        return self.components[name]

    def forms(self, family: type[Component]) -> list[type[Component]]:
        """The causal forms of a family here: its own first, then those that other files of this library add."""
        own = family.forms()
        if not family.family:
            return own
        added = [cls for cls in self.components.values() if issubclass(cls, family) and not cls.family]
        return own + [cls for cls in added if not any(issubclass(cls, form) for form in own)]

    def fluid(self, name: str, place: Place | None = None) -> type[Fluid]:
        """The fluid class called ``name``; raises :class:`InputError` offering the nearest."""
        if name not in self.fluids:
            raise InputError(f"unknown fluid type {name!r}: {nearest(name, self.fluids)}", place)
        return self.fluids[name]

    def extended(self, path: Path, place: Place | None) -> Library:
        """This library with the classes of a user's file; a name already taken is an error."""
        module = _load_file(path, place)
        components, fluids = dict(self.components), dict(self.fluids)
        for name, found in _classes(module):
            if name in components or name in fluids:
                raise InputError(
                    f"{path.name}: class {found.__name__} would be the type {name!r}, which already exists; "
                    "rename the class",
                    place,
                )
            _put(components, fluids, name, found)
        return Library(components, fluids)


@cache
def installed() -> Library:
    """Everything found through entry points."""
    components: dict[str, type[Component]] = {}
    fluids: dict[str, type[Fluid]] = {}
    for entry in sorted(importlib.metadata.entry_points(group=GROUP), key=lambda e: e.name):
        module = importlib.import_module(entry.module)
        modules = [module]
        if hasattr(module, "__path__"):
            names = sorted(info.name for info in pkgutil.iter_modules(module.__path__))
            modules += [importlib.import_module(f"{module.__name__}.{name}") for name in names]
        for each in modules:
            for name, found in _classes(each):
                if name in components or name in fluids:
                    raise ComponentError(f"two installed libraries define {name!r} ({found.__module__} is the second)")
                _put(components, fluids, name, found)
    return Library(components, fluids)


def _put(components: dict[str, type[Component]], fluids: dict[str, type[Fluid]], name: str, found: type) -> None:
    if issubclass(found, Component):
        components[name] = found
    elif issubclass(found, Fluid):
        fluids[name] = found


def _classes(module: ModuleType) -> Iterator[tuple[str, type]]:
    """Public component and fluid classes that the module itself defines."""
    for name, found in vars(module).items():
        if (
            inspect.isclass(found)
            and found.__module__ == module.__name__
            and not name.startswith("_")
            and issubclass(found, (Component, Fluid))
        ):
            yield snake_case(name), found


def _load_file(path: Path, place: Place | None) -> ModuleType:
    if not path.is_file():
        raise InputError(
            f"the library file {path.name} does not exist; it is looked for beside the circuit file", place
        )
    if path.suffix != ".py":
        raise InputError(f"the library file {path.name} is not a Python file; its name must end in .py", place)
    try:
        return _imported(path.resolve(), path.stat().st_mtime_ns)
    except ComponentError as error:
        raise InputError(f"{path.name}: {error}", place) from None
    except (Exception, SystemExit) as error:  # whatever a user's file raises is the user's to mend
        frames = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path.resolve())]
        line = error.lineno if isinstance(error, SyntaxError) else frames[-1].lineno if frames else None
        said = " ".join((error.msg if isinstance(error, SyntaxError) else str(error)).split())
        where = f", line {line}" if line else ""
        raise InputError(
            f"the library file {path.name}{where} does not import: {type(error).__name__}: {said}", place
        ) from None


@cache
def _imported(path: Path, changed: int) -> ModuleType:
    """The module of a file, imported again once the file has changed."""
    name = f"crescentlab_user_{path.stem}_{abs(hash(path)):x}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module
