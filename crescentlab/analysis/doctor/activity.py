r"""Energy through the parts of a circuit: which of them the run is about, and which could be left out.

.. math:: A_i = \int \Bigl|\sum_{ports} e f\Bigr| dt, \qquad AI_i = A_i / \sum_k A_k

A_i [J] the activity of component i; e f the power into it at each port: p q (pressure above the atmosphere times flow
at 0 bar gauge), f v, torque omega, and of a chamber p dV/dt. A part that hands on what it takes, like a gear set
without losses, has little activity of its own. Neither has the mass of a load that is lifted: what counts there is
what passes on from one neighbour to another at the nets where it gives the motion,
\tfrac12 \sum_{members} \int |e f| dt. Integrated on the Gauss nodes of the run's own polynomials.
Source: L. S. Louca, J. L. Stein, G. M. Hulbert, J. K. Sprague, Proper model generation: an energy-based methodology,
Proc. Int. Conf. Bond Graph Modeling (ICBGM), Phoenix (1997) 44-49.
"""

from __future__ import annotations

import casadi as ca
import numpy as np

from crescentlab.analysis.spectrum.dense import MOST_TIMES
from crescentlab.domain import CHAMBER, HYDRAULIC, ROTATIONAL, TRANSLATIONAL, Domain, Port
from crescentlab.result import Result
from crescentlab.solvers.trajectory import GAUSS_NODES, GAUSS_WEIGHTS
from crescentlab.system import System

Array = np.ndarray

POWER: dict[Domain, tuple[str, str]] = {HYDRAULIC: ("p", "q"), TRANSLATIONAL: ("v", "f"),
                                        ROTATIONAL: ("omega", "torque"), CHAMBER: ("dV", "p")}  # fmt: skip
"""The two variables of a port whose product is its power, where the domain carries power."""


def activities(result: Result) -> dict[str, float]:
    """Activity [J] of every component that has a port with power, largest first."""
    system = result.system
    names, function = system.once("powers", lambda: _powers(system))
    total = _integrated(result, names, function)
    order = np.argsort(-total, kind="stable")
    return {names[k]: float(total[k]) for k in order}


def passed_on(result: Result) -> dict[str, float]:
    """Energy [J] that passes at the nets where a component gives the motion, by component."""
    system = result.system
    givers, function = system.once("powers of nets", lambda: _passing(system))
    found: dict[str, float] = {}
    for giver, energy in zip(givers, _integrated(result, givers, function), strict=True):
        found[giver] = found.get(giver, 0.0) + float(energy) / 2
    return found


def _integrated(result: Result, names: list[str], function: ca.Function) -> Array:
    """Integrals of the magnitudes of powers, one per name, over the run [J]."""
    pieces = result.trajectory.pieces
    low, high = np.asarray(pieces.low, float), np.asarray(pieces.high, float)
    total = np.zeros(len(names))
    if not names or not low.size:
        return total
    h, b = np.asarray(pieces.h), np.asarray(pieces.b)
    for begin in range(0, low.size, MOST_TIMES):
        some = np.arange(begin, min(begin + MOST_TIMES, low.size))
        length = high[some] - low[some]
        for node, weight in zip(GAUSS_NODES, GAUSS_WEIGHTS, strict=True):
            t = low[some] + node * length
            x = pieces.at(some, t)
            power = np.asarray(function(t.reshape(1, -1), x.T, h[some].T, b[some].T, result.values.p))
            total += weight * (np.abs(power) @ length)
    return total


def indices(found: dict[str, float]) -> dict[str, float]:
    """Activity index: each component's share in the activity of all; zeros if there is none at all."""
    total = sum(found.values())
    return {name: value / total if total > 0 else 0.0 for name, value in found.items()}


def _powers(system: System) -> tuple[list[str], ca.Function]:
    """Components with power at their ports, and the function that gives it [W], positive into them."""
    names: list[str] = []
    powers: list[ca.SX] = []
    for name, component in system.plan.components.items():
        ports = [port for port in type(component).ports() if port.role != "reads" and port.domain in POWER]
        if ports:
            names.append(name)
            powers.append(sum((_power(system, name, port) for port in ports), ca.SX(0)))
    return names, ca.Function("P", system.arguments, [ca.densify(ca.vertcat(*powers))])


def _passing(system: System) -> tuple[list[str], ca.Function]:
    """For each member of each net of motion the component that gives there; the function of the members' powers."""
    givers: list[str] = []
    powers: list[ca.SX] = []
    for net in system.plan.graph.nets:
        giver = system.plan.givers[net.name]
        if giver is None or net.domain not in (TRANSLATIONAL, ROTATIONAL):
            continue
        for member in net.members:
            if type(system.plan.components[member.instance]).port_named(member.port.name).role == "reads":
                continue
            names = (f"{member.instance}.{member.port.name}.{v}" for v in POWER[net.domain])
            across, through = (system.find(name).expression()[member.element] for name in names)
            givers.append(giver.instance)
            powers.append(across * through)
    return givers, ca.Function("P", system.arguments, [ca.densify(ca.vertcat(*powers))])


def _power(system: System, name: str, port: Port) -> ca.SX:
    """Power into a component at one port, all its elements together."""
    across, through = (system.find(f"{name}.{port.name}.{v}").expression() for v in POWER[port.domain])
    power = sum((a * f for a, f in zip(across, through, strict=True)), ca.SX(0))
    # what shapes a volume is pushed by the pressure as the volume grows; the fluid in it gives that work
    return -power if port.domain is CHAMBER and port.role == "takes" else power
