"""YAML text -> :class:`Netlist`: the sections of a circuit file, checked for shape, with their places.

A netlist knows nothing of component classes; what a component's keys mean is settled when the
netlist is elaborated with a library.
"""

from __future__ import annotations

import keyword
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from crescentlab.errors import InputError, Place, UnitError, nearest
from crescentlab.explain import validated
from crescentlab.units import QUANTITIES, Time
from crescentlab.yaml_text import Node, read


def _no_keyword(name: str) -> str:
    for word in name.split("."):
        if keyword.iskeyword(word) or word == "pi":
            raise ValueError(f"{word!r} has a meaning of its own in expressions; choose another name")
    return name


def _not_time(name: str) -> str:
    if name == "time":
        raise ValueError("'time' is the first column of every result; choose another name")
    return name


Name = Annotated[str, Field(pattern=r"^[A-Za-z_]\w*$"), AfterValidator(_no_keyword)]
OutputName = Annotated[
    str, Field(pattern=r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)?$"), AfterValidator(_no_keyword), AfterValidator(_not_time)
]


FLUID = "{type: simple_oil, density: 860 kg/m^3, kinematic_viscosity: 35 cSt, bulk_modulus: 14000 bar}"
"""A fluid as messages write it."""
SMALLEST_RTOL = 1e-13
"""Below this, rounding spoils what a solver compares."""


def _one_or_many(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ComponentSection(BaseModel):
    """One component: its type, start values, and parameters under their own names."""

    model_config = ConfigDict(extra="allow", frozen=True)

    type: str = Field(description="a component type, or the file of a subcircuit such as ./relief_valve_part.yaml")
    start: dict[str, str | list[str]] = Field(default={}, description="start values of states: {p: 1 bar}")


class NetSection(_Section):
    """A net in its long form, for circuits of several fluids."""

    fluid: str | None = Field(default=None, description="name of one of the circuit's fluids")
    ports: list[str] = Field(description="component.port, component.port[2], component.port[*]")


class SimulationSection(_Section):
    """How long and how exactly to integrate."""

    stop: Time = Field(default=1.0, gt=0, description="end time")
    solver: Literal["auto", "lsoda", "bdf", "radau", "rk45", "dop853", "cvode", "rodas", "dopri"] = Field(
        default="auto", description="integration method"
    )
    rtol: float = Field(default=1e-6, ge=SMALLEST_RTOL, lt=1, description="relative tolerance of every state")
    max_step: Time | None = Field(
        default=None, gt=0, description="longest step; default from the circuit's own time scales"
    )
    output_step: Time | None = Field(default=None, gt=0, description="uniform output grid; default the accepted steps")
    compile: bool | None = Field(default=None, description="compile the equations; default where it pays")
    start: Literal["steady"] | None = Field(
        default=None, description="steady: the run begins at the operating point; default: at the start values"
    )
    start_pressure: str | None = Field(
        default=None, description="start pressure of every part that states none of its own; an expression too"
    )
    stop_when: str | None = Field(default=None, description="a condition that ends the run: line.p > 9 bar")
    period: str | None = Field(
        default=None, description="time after which the circuit repeats itself, an expression too: '= 2 * pi / speed'"
    )


class PlotSection(_Section):
    """One picture: variables over time, or over another variable."""

    y: Annotated[list[str], BeforeValidator(_one_or_many)] = Field(min_length=1, description="variables")
    x: str | None = Field(default=None, description="variable of the horizontal axis; default time")
    title: str | None = Field(default=None, description="title")
    start: Time | None = Field(default=None, ge=0, description="first time shown")
    stop: Time | None = Field(default=None, gt=0, description="last time shown")

    @model_validator(mode="after")
    def _in_order(self) -> PlotSection:
        if self.start is not None and self.stop is not None and self.start >= self.stop:
            raise ValueError("start must lie before stop")
        return self


class CircuitFile(_Section):
    """The sections of a circuit file."""

    crescentlab: Literal["1"] = Field(description="format version")
    title: str = Field(default="", description="one line")
    description: str = Field(default="", description="what the circuit shows")
    library: list[str] = Field(default=[], description="the user's own component files: [./my_components.py]")
    fluid: dict[str, str] | None = Field(default=None, description="the one fluid: {type: simple_oil, ...}")
    fluids: dict[Name, dict[str, str]] = Field(default={}, description="several fluids by name; nets choose")
    parameters: dict[Name, str] = Field(default={}, description="numbers with units, words, or = expressions")
    ports: dict[Name, str] = Field(default={}, description="of a subcircuit: port: net")
    components: dict[Name, ComponentSection] = Field(default={}, description="name: {type: ..., parameter: value}")
    nets: dict[Name, list[str] | NetSection] = Field(default={}, description="name: [component.port, ...]")
    outputs: dict[OutputName, str] = Field(default={}, description="name: '= expression of variables'")
    simulation: SimulationSection = Field(default=SimulationSection())
    display: dict[str, str] = Field(default={}, description="units of summaries and plots: {pressure: bar}")
    plots: list[PlotSection] = Field(default=[])


@dataclass(frozen=True)
class Netlist:
    """A circuit file: its sections, the tree they came from, and the folder its files lie in."""

    sections: CircuitFile
    node: Node
    name: str
    folder: Path = field(default_factory=Path)

    @staticmethod
    def read(path: Path) -> Netlist:
        """Read and check a circuit file."""
        return Netlist.of_node(read(path), path.stem, path.parent)

    @staticmethod
    def of(data: Mapping[str, Any], name: str = "circuit", folder: Path | None = None) -> Netlist:
        """A netlist from plain Python data shaped like a circuit file."""
        return Netlist.of_node(Node.of(dict(data)), name, folder or Path())

    @staticmethod
    def of_node(node: Node, name: str, folder: Path) -> Netlist:
        """Check the tree's shape; raises :class:`InputError` at the offending line."""
        if not isinstance(node.value, dict):
            raise InputError("a circuit file is a mapping that begins with `crescentlab: 1`", node.place)
        if "crescentlab" not in node.value:
            raise InputError("the format version is missing; begin the file with `crescentlab: 1`", node.place)
        _collections(node)
        sections = validated(CircuitFile, node)
        if not sections.components:
            raise InputError(
                "there are no components; list them, for example components: {tank: {type: tank}}",
                node.place_of("components"),
            )
        if sections.fluid is not None and sections.fluids:
            raise InputError("write either fluid: or fluids:, not both", node.place_of("fluids"))
        if sections.ports and sections.simulation.stop_when:
            raise InputError(
                "a subcircuit cannot stop the run; move stop_when to the circuit",
                node.place_of("simulation", "stop_when"),
            )
        _namespace(sections, node)
        _check_display(sections, node)
        return Netlist(sections, node, name, folder)

    def place(self, *path: Any) -> Place | None:
        """Where something stands: ``place("components", "line", "volume")``."""
        return self.node.place_of(*path)


_KINDS: dict[str, tuple[type, str]] = {
    "fluid": (dict, FLUID), "fluids": (dict, f"{{oil: {FLUID}}}"),
    "parameters": (dict, "{supply: 30 L/min}"), "components": (dict, "{tank: {type: tank}}"),
    "ports": (dict, "{inlet: p_line}"),
    "nets": (dict, "{p_line: [pump.port, line.port]}"), "outputs": (dict, "{loss: '= line.p * valve.q'}"),
    "simulation": (dict, "{stop: 50 ms}"), "display": (dict, "{pressure: bar}"),
    "plots": (list, "[{y: [line.p]}]"), "library": (list, "[./my_components.py]"),
}  # fmt: skip


def _collections(node: Node) -> None:
    """Refuse text where a section needs keys or items, and allow an empty section."""
    assert isinstance(node.value, dict)
    for key, (kind, example) in _KINDS.items():
        child = node.value.get(key)
        if child is not None and child.value == "":
            child.value = kind()
        _shaped(node, (key,), kind, example)
    for name in _keys(node, "components"):
        _shaped(node, ("components", name), dict, "{type: orifice, area: 5 mm^2}")
        _shaped(node, ("components", name, "start"), dict, "{p: 1 bar}")
    for name in _keys(node, "nets"):
        if not isinstance(node.find(("nets", name)).value, dict):
            _shaped(node, ("nets", name), list, "[pump.port, line.port]")
    for name in _keys(node, "fluids"):
        _shaped(node, ("fluids", name), dict, FLUID)


def _keys(node: Node, section: str) -> list[str]:
    value = node.find((section,)).value
    return list(value) if isinstance(node.value, dict) and section in node.value and isinstance(value, dict) else []


def _shaped(node: Node, path: tuple[str, ...], kind: type, example: str) -> None:
    """Refuse what stands at ``path`` (if anything does) unless it has keys (dict) or items (list)."""
    parent = node.find(path[:-1]).value
    if not isinstance(parent, dict) or path[-1] not in parent or isinstance(parent[path[-1]].value, kind):
        return
    needs = "keys" if kind is dict else "a list"
    raise InputError(f"{path[-1]} needs {needs}, for example {path[-1]}: {example}", node.place_of(*path))


def _namespace(sections: CircuitFile, node: Node) -> None:
    for name in sections.nets:
        if name in sections.components:
            raise InputError(f"{name!r} names both a component and a net; rename one", node.place_of("nets", name))
    for name in sections.parameters:
        if name in sections.components or name in sections.nets:
            raise InputError(
                f"{name!r} names a parameter and a component or net; rename one", node.place_of("parameters", name)
            )


def _check_display(sections: CircuitFile, node: Node) -> None:
    for quantity, unit in sections.display.items():
        place = node.place_of("display", quantity)
        if quantity not in QUANTITIES:
            raise InputError(f"display: unknown quantity {quantity!r}: {nearest(quantity, QUANTITIES)}", place)
        try:
            QUANTITIES[quantity].factor(unit)
        except UnitError as error:
            raise InputError(f"display.{quantity}: {error.message}", place) from None


def net_ports(section: list[str] | NetSection) -> list[str]:
    """The ports a net lists, in either form."""
    return section.ports if isinstance(section, NetSection) else section
