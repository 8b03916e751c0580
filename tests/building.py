"""Circuits from plain Python for tests: data in the shape of a circuit file, and classes defined in the test."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from crescentlab.circuit import Circuit
from crescentlab.component import Component
from crescentlab.library import Library, installed
from crescentlab.netlist import Netlist
from crescentlab.result import Result

OIL = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "14000 bar"}


def library(*classes: type[Component]) -> Library:
    """The installed library and these classes under their type names."""
    return Library({**installed().components, **{c.type_name(): c for c in classes}}, installed().fluids)


def circuit(
    *classes: type[Component],
    components: Mapping[str, Any],
    nets: Mapping[str, Any] | None = None,
    folder: Path | None = None,
    **sections: Any,
) -> Circuit:
    """A circuit of the library's components and ``classes``; values are text as in a circuit file."""
    data = {"crescentlab": "1", "components": components, "nets": nets or {}, **sections}
    return Circuit(Netlist.of(data, folder=folder), library=library(*classes))


def alone(
    cls: type[Component],
    start: Mapping[str, Any] | None = None,
    *,
    simulation: Mapping[str, Any] | None = None,
    **parameters: Any,
) -> Circuit:
    """A circuit of one part called ``part``, without nets."""
    part = {"type": cls.type_name(), **parameters, **({"start": start} if start else {})}
    return circuit(cls, components={"part": part}, **({"simulation": simulation} if simulation else {}))


def fired(result: Result, name: str) -> list[float]:
    """Times at which an event happened, once for each time it fired."""
    return [happening.time for happening in result.trajectory.happenings for n in happening.names if n == name]
