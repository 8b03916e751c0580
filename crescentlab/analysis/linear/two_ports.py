"""Lines of a linear model replaced by their exact two-ports: the compensation theorem.

A component that offers ``two_port(omega, p_mean, q_mean, fluid)`` says what flows into its two ends per end pressures
(complex array (m, 2, 2)); the law is its own. The linear model, probed by flows into the nets of the lines' ends,
answers input u with net pressures p_u and line flows q_u, and probe flows j with Z j and Q j. The exact line takes
Y E p instead of what the model's line takes, so that the difference is to be brought into the nets:

.. math:: j = E^T \\left(q_u + Q j - Y E (p_u + Z j)\\right), \\qquad p = p_u + Z j, \\quad y = y_u + G j

E (ends, nets) says which net an end is on. Nothing of the model's line remains in p and y but its operating point.
Source: compensation (substitution) theorem of linear networks.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from crescentlab.analysis.linear.inputs import parameter_places
from crescentlab.analysis.linear.model import LinearModel
from crescentlab.domain import HYDRAULIC
from crescentlab.elaborate import Design
from crescentlab.errors import InputError
from crescentlab.fluid import Fluid
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.system import System, Values

Array = np.ndarray


@runtime_checkable
class TwoPort(Protocol):
    """What a line offers to be replaced by its exact law."""

    def two_port(self, omega: Any, p_mean: float, q_mean: float, fluid: Fluid) -> Any:
        """Flows into its ends per end pressures [m^3/(s Pa)] at omega [rad/s], shape (m, 2, 2)."""


@dataclass(frozen=True)
class ExactLine:
    """A line of the circuit, its ends' nets, and the operating point that its law is taken at."""

    name: str
    ports: tuple[str, str]
    nets: tuple[str, str]
    component: TwoPort
    fluid: Fluid
    p_mean: float = 0.0
    q_mean: float = 0.0

    @property
    def flows(self) -> tuple[str, str]:
        """Variables of the flows into it."""
        return f"{self.name}.{self.ports[0]}.q", f"{self.name}.{self.ports[1]}.q"

    @property
    def pressures(self) -> tuple[str, str]:
        """Variables of its ends' pressures."""
        return f"{self.name}.{self.ports[0]}.p", f"{self.name}.{self.ports[1]}.p"

    def admittance(self, omega: Array) -> Array:
        """Y, shape (m, 2, 2)."""
        return np.asarray(self.component.two_port(omega, self.p_mean, self.q_mean, self.fluid))


def exact_lines(design: Design, system: System, values: Values, at: Snapshot) -> list[ExactLine]:
    """Every line that has an exact law, at the operating point; raises :class:`InputError` if there is none."""
    found: list[ExactLine] = []
    for name, instance in design.instances.items():
        part = instance.component
        if not isinstance(part, TwoPort):
            continue
        ports = [p.name for p in type(part).ports() if p.domain is HYDRAULIC][:2]
        nets = [_net_of(design, name, port) for port in ports]
        line = ExactLine(
            name, (ports[0], ports[1]), (nets[0], nets[1]), part, design.fluids[system.plan.fluids[name]["fluid"]]
        )
        now = system.series(
            [*line.pressures, *line.flows], np.array([at.t]), at.x[None], at.h[None], at.b[None], values.p
        )
        p_a, p_b, q_a, q_b = np.array(now).ravel().tolist()
        found.append(
            ExactLine(name, line.ports, line.nets, part, line.fluid, (p_a + p_b) / 2, (q_a - q_b) / 2)
        )  # fmt: skip
    if not found:
        raise InputError(
            "--exact-lines: no part of this circuit has an exact law of its own (a method two_port); "
            "the pipe and the lines have one"
        )
    return found


def _net_of(design: Design, instance: str, port: str) -> str:
    """The net that a port is on."""
    return next(n.name for n in design.nets for r in n.ports if (r.instance, r.port.name) == (instance, port))


def only_lines_tick(lines: Sequence[ExactLine], model: LinearModel) -> bool:
    """Whether no part ticks but lines that are replaced."""
    ticking = {event.name.rpartition(".")[0] for event in model.system.events if event.kind == "every"}
    return ticking <= {line.name for line in lines}


def check_inside(lines: Sequence[ExactLine], design: Design, outputs: Sequence[str]) -> None:
    """Refuse outputs inside a line: its exact law knows its ends alone."""
    texts = {o.name: o for o in design.outputs}
    for line in lines:
        for name in outputs:
            inside = [name] if name.startswith(f"{line.name}.") and name not in (*line.flows, *line.pressures) else []
            if name in texts:
                read = re.findall(r"[A-Za-z_][\w.]*", texts[name].text)
                full = [texts[name].scope + word for word in read]
                inside += [word for word in full if word.startswith(f"{line.name}.") and word not in line.pressures]
            if inside:
                raise InputError(
                    f"--exact-lines: output {name} is inside {line.name}, whose exact law knows its ends alone; "
                    f"name {line.flows[0]}, {line.pressures[0]}, or a variable of another part"
                )


def check_acting(lines: Sequence[ExactLine], model: LinearModel) -> None:
    """Refuse inputs that act inside a line, or on its fluid."""
    names = list(parameter_places(model.system, model.design))
    for line in lines:
        fluid = model.system.plan.fluids[line.name]["fluid"]
        for u in model.inputs:
            acting = [names[k] for k, _ in u.direction if k < len(names)]
            if any(name.startswith((f"{line.name}.", f"{fluid}.")) for name in acting):
                raise InputError(
                    f"--exact-lines: input {u.name} acts inside {line.name}, whose exact law knows its ends alone; "
                    "name a parameter of another part, or a net"
                )


def compensated(
    omega: Array, lines: Sequence[ExactLine], nets: Sequence[str], H: Array, sizes: tuple[int, int]
) -> Array:
    """Responses of the user's outputs to the user's inputs with exact lines, shape (m, outputs, inputs).

    ``H`` (m, outputs + nets + ends, inputs + nets): the model's responses; ``sizes``: the user's outputs and inputs.
    """
    n_y, n_u = sizes
    n = len(nets)
    E = np.zeros((2 * len(lines), n))
    Y = np.zeros((omega.size, 2 * len(lines), 2 * len(lines)), dtype=complex)
    for k, line in enumerate(lines):
        for end, net in enumerate(line.nets):
            E[2 * k + end, nets.index(net)] = 1.0
        Y[:, 2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = line.admittance(omega)
    y_u, G = H[:, :n_y, :n_u], H[:, :n_y, n_u:]
    p_u, Z = H[:, n_y : n_y + n, :n_u], H[:, n_y : n_y + n, n_u:]
    q_u, Q = H[:, n_y + n :, :n_u], H[:, n_y + n :, n_u:]
    taken = Y @ E
    j = np.linalg.solve(np.eye(n) - E.T @ (Q - taken @ Z), E.T @ (q_u - taken @ p_u))
    exact = y_u + G @ j
    return np.asarray(exact)


def end_responses(
    omega: Array, lines: Sequence[ExactLine], names: Sequence[str], pressures: Array, exact: Array
) -> Array:
    """``exact`` with the rows that are flows into a line's end taken from its own law.

    ``names``: the rows' variables; ``pressures``: exact end pressures (m, ends, inputs).
    """
    found = exact.copy()
    for k, line in enumerate(lines):
        flows = line.admittance(omega) @ pressures[:, 2 * k : 2 * k + 2]
        for end, name in enumerate(line.flows):
            for row in [r for r, other in enumerate(names) if other == name]:
                found[:, row] = flows[:, end]
    return found
