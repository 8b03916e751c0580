"""Circuits of any size for the benchmarks: chains, square grids and stars of volumes joined by orifices."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from crescentlab.netlist import Netlist

FLUID = {"type": "simple_oil", "density": "860 kg/m^3", "kinematic_viscosity": "35 cSt", "bulk_modulus": "1.4 GPa"}


def edges(kind: str, n: int) -> Iterator[tuple[int, int]]:
    """Pairs of volumes that an orifice joins; ``kind`` is chain (narrow after reordering), grid (wide) or star."""
    if kind == "chain":
        yield from ((k, k + 1) for k in range(n - 1))
        return
    if kind == "star":
        yield from ((0, k + 1) for k in range(n - 1))
        return
    side = round(n**0.5)
    for k in range(side * side):
        if k % side < side - 1:
            yield k, k + 1
        if k < side * (side - 1):
            yield k, k + side


def circuit_file(kind: str, n: int) -> dict[str, Any]:
    """n volumes joined by orifices; a pulsating source at the first, a tank behind the last. A chain has n orifices."""
    n = round(n**0.5) ** 2 if kind == "grid" else n
    components: dict[str, Any] = {
        "tank": {"type": "tank"}, "out": {"type": "orifice", "area": "5 mm^2"},
        "source": {"type": "signal_flow_source"},
        "sine": {"type": "sine", "mean": "10 L/min", "amplitude": "5 L/min", "frequency": "200 Hz"},
    }  # fmt: skip
    nets = {f"n{k}": [f"v{k}.port"] for k in range(n)}
    for k in range(n):
        components[f"v{k}"] = {"type": "capacity", "volume": "20 cm^3", "start": {"p": "5 bar"}}
    for j, (a, b) in enumerate(edges(kind, n)):
        components[f"o{j}"] = {"type": "orifice", "area": "20 mm^2"}
        nets[f"n{a}"].append(f"o{j}.a")
        nets[f"n{b}"].append(f"o{j}.b")
    nets["n0"].append("source.port")
    nets[f"n{n - 1}"].append("out.a")
    nets |= {"flow": ["sine.y", "source.flow"], "drain": ["out.b", "tank.port"]}
    return {"crescentlab": "1", "fluid": dict(FLUID), "components": components, "nets": nets}


def netlist(kind: str, n: int) -> Netlist:
    """The same as a netlist."""
    return Netlist.of(circuit_file(kind, n), kind)
