"""Frequency responses and hydraulic impedances of a circuit, with the lines' exact two-ports as an overlay."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from crescentlab import arguments
from crescentlab.analysis.linear.inputs import net_named
from crescentlab.analysis.linear.model import LinearModel, linear_model, operating_point
from crescentlab.analysis.linear.modes import Mode, modes
from crescentlab.analysis.linear.transfer_paths import check_paths
from crescentlab.analysis.linear.two_ports import (
    ExactLine,
    check_acting,
    check_inside,
    compensated,
    end_responses,
    exact_lines,
    only_lines_tick,
)
from crescentlab.arguments import Settings
from crescentlab.circuit import Circuit, Start, check_circuit
from crescentlab.domain import HYDRAULIC
from crescentlab.elaborate import Design
from crescentlab.errors import InputError, UnitError, nearest
from crescentlab.units import QUANTITIES, Quantity

if TYPE_CHECKING:
    from crescentlab.analysis.steady import OperatingPoint

Array = np.ndarray

POINTS = 1000
"""Points of a frequency grid."""
MOST_POINTS = 200_000
AROUND = np.array([-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0])
"""Points added around each mode, in half widths of its resonance."""
BETWEEN = 8
"""Points added on each side of a maximum of a grid."""
IMAGES = 0.25
"""Part of the Nyquist frequency from which the ticks' images show between the ticks."""


@dataclass(frozen=True)
class Transfer:
    """One response over frequency: output per input, complex, in SI; or an impedance."""

    output: str
    input: str
    of: Quantity
    per: Quantity
    value: Array
    exact: Array | None = None
    """With the lines' exact two-ports."""
    impedance: bool = False

    @property
    def name(self) -> str:
        """What it is, as columns and legends show it."""
        return f"Z({self.input})" if self.impedance else f"{self.output} / {self.input}"


@dataclass(frozen=True)
class Responses:
    """Transfers over angular frequencies omega [rad/s], the linear model of the user's inputs and outputs, modes."""

    model: LinearModel
    modes: list[Mode]
    omega: Array
    transfers: list[Transfer]
    lines: list[ExactLine]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class _Impedance:
    """A port or a net whose impedance is wanted: p of the net, and the flow it is divided by."""

    name: str
    net: str
    pressure: str
    flow: str | None
    """Flow into the port; None: the flow brought into the net."""


def band(text: str) -> tuple[float, float]:
    """Angular frequencies [rad/s] of '1 Hz:2 kHz' or '10 rad/s:1e4 rad/s'; raises :class:`InputError`."""
    low, colon, high = text.partition(":")
    if not colon:
        raise InputError(f"--frequencies {text}: write two frequencies, for example '1 Hz:2 kHz'")
    ends = [_angular(part.strip(), text) for part in (low, high)]
    if not 0 < ends[0] < ends[1]:
        raise InputError(f"--frequencies {text}: the first must lie above 0 and below the second")
    return ends[0], ends[1]


def _angular(part: str, text: str) -> float:
    try:
        if part.replace(" ", "").endswith("rad/s"):
            return QUANTITIES["speed"].parse(part)
        return 2 * math.pi * QUANTITIES["frequency"].parse(part)
    except UnitError as error:
        raise InputError(f"--frequencies {text}: {error.message}") from None


def grid(low: float, high: float, points: int, found: Sequence[Mode] = ()) -> Array:
    """Angular frequencies [rad/s] in equal ratios, and more of them around lightly damped modes."""
    if not 2 <= points <= MOST_POINTS:
        raise InputError(f"--points {points}: write a number from 2 to {MOST_POINTS}")
    extra = [abs(m.eigenvalue.imag) + AROUND * max(abs(m.eigenvalue.real), 1e-9) for m in found if m.eigenvalue.imag]
    every = np.concatenate([np.geomspace(low, high, points), *extra])
    return np.unique(every[(every >= low) & (every <= high)])


def between(omega: Array, transfers: Sequence[Transfer]) -> Array:
    """More points beside the maxima of the magnitudes, of the model and of the exact lines."""
    extra: list[Array] = []
    for values in (v for t in transfers for v in (t.value, t.exact) if v is not None):
        size = np.abs(values)
        for k in np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1:
            extra += [np.linspace(omega[side], omega[k], BETWEEN + 2)[1:-1] for side in (k - 1, k + 1)]
    return np.unique(np.concatenate(extra)) if extra else np.zeros(0)


def joined(
    omega: Array, transfers: Sequence[Transfer], extra: Array, more: Sequence[Transfer]
) -> tuple[Array, list[Transfer]]:
    """Two grids and their transfers as one, by rising frequency."""
    every, order = np.unique(np.concatenate([omega, extra]), return_index=True)

    def merge(a: Array, b: Array) -> Array:
        return np.asarray(np.concatenate([a, b])[order])

    return every, [
        replace(
            a,
            value=merge(a.value, b.value),
            exact=None if a.exact is None or b.exact is None else merge(a.exact, b.exact),
        )
        for a, b in zip(transfers, more, strict=True)
    ]


def frequency_response(
    circuit: Circuit, parameters: Settings | None = None, *,
    at: OperatingPoint | Start | None = None,
    inputs: Sequence[str] = (), outputs: Sequence[str] = (), impedances: Sequence[str] = (),
    omega: Array | tuple[float, float] = (2 * math.pi, 4000 * math.pi), points: int = POINTS, exact: bool = False,
) -> Responses:  # fmt: skip
    """Every output per every input, and the impedances, over ``omega`` [rad/s]: an array, or the ends of a grid.

    An impedance is that of a net (p per flow brought into it) or of a component's port (p per flow into the component
    there, whatever drives the circuit from outside it). ``exact`` adds what the lines' own laws give. Names, and what
    is refused: :func:`crescentlab.analysis.linear.linearize`.
    """
    check_circuit(circuit, "frequency_response")
    settings = arguments.settings(parameters)
    design = circuit.design(settings)
    wanted = [_impedance(design, name) for name in dict.fromkeys(impedances)]
    inputs, outputs = list(dict.fromkeys(inputs)), list(dict.fromkeys(outputs))
    point = operating_point(circuit, settings, at)
    lines: list[ExactLine] = []
    if exact:
        system = circuit.system(settings)
        lines = exact_lines(design, system, system.values(design), point)
        check_inside(lines, design, outputs)
    nets = list(dict.fromkeys(net for line in lines for net in line.nets))
    asked = _Asked(inputs, outputs, wanted, lines, nets)
    whole = linear_model(circuit, settings, at=point, inputs=asked.all_inputs, outputs=asked.all_outputs)
    check_acting(lines, whole)
    model = whole.select(inputs, outputs)
    warnings = [*model.warnings, *check_paths(model)]
    found = modes(model)
    still = whole
    if lines and whole.period is not None and only_lines_tick(lines, whole):
        still = linear_model(
            circuit, settings, at=point, inputs=asked.all_inputs, outputs=asked.all_outputs, ticking=False
        )
    if isinstance(omega, tuple):
        omega = grid(*omega, points, found)
        transfers = asked.transfers(whole, still, omega)
        extra = between(omega, transfers)
        if extra.size:
            omega, transfers = joined(omega, transfers, extra, asked.transfers(whole, still, extra))
    else:
        omega = np.asarray(omega, dtype=float)
        transfers = asked.transfers(whole, still, omega)
    if transfers and omega[-1] > IMAGES * whole.nyquist:
        shown = f"{IMAGES * whole.nyquist / (2 * math.pi):.4g} Hz"
        warnings.append(f"above {shown} the response is that at the instants of the ticks; between them images show")
    return Responses(model, found, omega, transfers, lines, tuple(warnings))


@dataclass(frozen=True)
class _Asked:
    """What is asked of one linear model, and how it is taken out of its responses."""

    inputs: list[str]
    outputs: list[str]
    wanted: list[_Impedance]
    lines: list[ExactLine]
    nets: list[str]
    """Nets of the lines' ends."""

    @property
    def own_inputs(self) -> list[str]:
        """Inputs of the user, and flows for the impedances."""
        return [*self.inputs, *(w.net for w in self.wanted)]

    @property
    def all_inputs(self) -> list[str]:
        """Those, and flows at the lines' ends."""
        return [*self.own_inputs, *(f"{net}.q" for net in self.nets)]

    @property
    def rows(self) -> list[str]:
        """Outputs of the user, and what impedances are made of."""
        return [*self.outputs, *(v for w in self.wanted for v in (w.pressure, w.flow) if v is not None)]

    @property
    def all_outputs(self) -> list[str]:
        """Those, and the pressures and flows at the lines' ends."""
        return [*self.rows, *(f"{net}.p" for net in self.nets), *(v for line in self.lines for v in line.flows)]

    def responses(self, model: LinearModel, omega: Array) -> Array:
        """Of all outputs to all inputs, in the order asked."""
        H = model.response(omega)
        names, drives = [o.name for o in model.outputs], [i.name for i in model.inputs]
        return H[:, [names.index(n) for n in self.all_outputs]][:, :, [drives.index(n) for n in self.all_inputs]]

    def transfers(self, model: LinearModel, bare: LinearModel, omega: Array) -> list[Transfer]:
        """Every response and impedance over omega.

        ``bare``: the model out of which the exact ones are made, that whose ticks stand still where only lines tick.
        What the model's lines do is compensated, so it need not be right, and no tick is left in the result.
        """
        if not self.own_inputs or not self.rows:
            return []
        H = self.responses(model, omega)
        y = H[:, : len(self.rows), : len(self.own_inputs)]
        y_exact = None
        if self.lines:
            y_exact = self.exact(omega, H if bare is model else self.responses(bare, omega))
        quantity = {o.name: o.quantity for o in model.outputs}
        per = {i.name: i.quantity for i in model.inputs}
        made = [
            Transfer(o, u, quantity[o], per[u], y[:, i, j], None if y_exact is None else y_exact[:, i, j])
            for i, o in enumerate(self.outputs)
            for j, u in enumerate(self.inputs)
        ]
        return made + [self.impedance(w, y, y_exact) for w in self.wanted]

    def exact(self, omega: Array, H: Array) -> Array:
        """Responses of the rows to the user's inputs with exact lines."""
        n_y, n_u, n = len(self.rows), len(self.own_inputs), len(self.nets)
        exact = compensated(omega, self.lines, self.nets, H, (n_y, n_u))
        with_nets = np.concatenate([H[:, n_y : n_y + n], H[:, n_y:]], axis=1)
        p = compensated(omega, self.lines, self.nets, with_nets, (n, n_u))
        at_ends = p[:, [self.nets.index(net) for line in self.lines for net in line.nets]]
        return end_responses(omega, self.lines, self.rows, at_ends, exact)

    def impedance(self, wanted: _Impedance, y: Array, y_exact: Array | None) -> Transfer:
        """Pressure over flow, out of the responses to flow brought into the net."""
        column = len(self.inputs) + self.wanted.index(wanted)
        row = self.rows.index(wanted.pressure)

        def ratio(values: Array) -> Array:
            above = values[:, row, column]
            below = np.ones_like(above) if wanted.flow is None else values[:, self.rows.index(wanted.flow), column]
            if not np.abs(above).any():
                raise InputError(
                    f"--impedance {wanted.name}: a source holds the pressure of {wanted.net[:-2]}; ask for the "
                    "response of a flow to the source's pressure instead, with --input and --output"
                )
            if (np.abs(below) == 0).any():
                raise InputError(f"--impedance {wanted.name}: no flow answers the pressure there; it is infinite")
            return np.asarray(above / below)

        exact = None if y_exact is None else ratio(y_exact)
        return Transfer(
            wanted.name, wanted.name, QUANTITIES["pressure"], QUANTITIES["flow"], ratio(y), exact, impedance=True
        )


def _impedance(design: Design, name: str) -> _Impedance:
    """A net, or a component's hydraulic port."""
    target = net_named(design, name)
    if target is not None:
        if target.net.ports[0].port.domain is not HYDRAULIC:
            raise InputError(
                f"--impedance {name}: this net is not hydraulic; ask for --input {name} and an --output of it"
            )
        element = "" if target.element is None else f"[{target.element}]"
        return _Impedance(name, f"{target.net.name}{element}.q", f"{target.net.name}.p{element}", None)
    for net in design.nets:
        for ref in net.ports:
            if name == f"{ref.instance}.{ref.port.name}" and ref.element is None:
                if net.ports[0].port.domain is not HYDRAULIC:
                    raise InputError(f"--impedance {name}: this port is not hydraulic")
                return _Impedance(name, f"{net.name}.q", f"{net.name}.p", f"{name}.q")
    known = [n.name for n in design.nets if n.ports[0].port.domain is HYDRAULIC]
    known += [f"{r.instance}.{r.port.name}" for n in design.nets for r in n.ports if r.port.domain is HYDRAULIC]
    raise InputError(f"--impedance {name}: no net or port of a component has this name: {nearest(name, known)}")
