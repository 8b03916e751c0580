"""How wrong a line's model is at the frequencies of its circuit, and the model to use instead.

A line that knows its exact law (``two_port``) is compared with what its own equations make of it
(:mod:`.line_models`), linearised about the means of the run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from crescentlab.analysis.doctor.line_advice import instead_of
from crescentlab.analysis.doctor.line_models import Ends, own_two_port, ports_of, scattering_error, tick_limit
from crescentlab.analysis.linear.two_ports import TwoPort
from crescentlab.analysis.spectrum import spectra
from crescentlab.analysis.spectrum.dense import Dense
from crescentlab.component import Component
from crescentlab.elaborate import Instance
from crescentlab.fluid import Fluid
from crescentlab.library import Library
from crescentlab.result import Result

Array = np.ndarray

STRONG = 0.1
"""Lines of at least this part of the strongest are the circuit's frequencies."""
MOST_FREQUENCIES = 20
"""Of each of a line's pressures and flows."""


@dataclass(frozen=True)
class LineError:
    """What is wrong with one line."""

    name: str
    type: str
    frequencies: Array
    """The circuit's frequencies [Hz] that pass through it, and at which it is judged."""
    errors: Array
    """Error at each; empty if the model was not judged."""
    bound: float
    note: str = ""
    """Why it was not judged, or what to write instead."""
    parts: int | None = None
    """Cells, nodes or lumps that meet the bound."""
    left_out: tuple[float, ...] = ()
    """Frequencies [Hz] that pass through it, but are too high for its ticks to judge it there."""

    @property
    def worst(self) -> tuple[float, float]:
        """Largest error and its frequency [Hz]."""
        k = int(np.argmax(self.errors))
        return float(self.errors[k]), float(self.frequencies[k])

    @property
    def within(self) -> bool:
        """Whether the error is below the bound, as far as is known."""
        return not self.errors.size or self.worst[0] <= self.bound


def line_errors(result: Result, library: Library, period: float | None, bound: float) -> list[LineError]:
    """Judge every line of a run that knows its exact law; ``period`` [s] of the circuit, if it has one."""
    found: list[LineError] = []
    for name, instance in result.design.instances.items():
        part = instance.component
        if not isinstance(part, TwoPort):
            continue
        kind = type(part).type_name()
        frequencies, ends = _passing(result, name, period)
        if not frequencies.size:
            found.append(LineError(name, kind, frequencies, np.zeros(0), bound, "nothing oscillates in it"))
            continue
        fluid = result.design.fluids[result.system.plan.fluids[name]["fluid"]]
        form = _form(type(result.system.plan.components[name]), part)
        found.append(_judged(instance, form, library, fluid, frequencies, ends, bound))
    return found


def _judged(
    instance: Instance, form: Component, library: Library, fluid: Fluid, frequencies: Array, ends: Ends, bound: float
) -> LineError:
    """One line against its exact law."""
    name, part = instance.name, instance.component
    assert isinstance(part, TwoPort)
    kind, nothing = type(part).type_name(), np.zeros(0)
    limit = tick_limit(form, fluid) / (2 * np.pi)
    above = tuple(frequencies[frequencies > limit].tolist())
    frequencies = frequencies[frequencies <= limit]
    if not frequencies.size:
        note = f"not judged: nothing oscillates in it below {limit:.4g} Hz, a quarter of its tick rate"
        return LineError(name, kind, frequencies, nothing, bound, note, left_out=above)
    omega = 2 * np.pi * frequencies
    own = own_two_port(form, fluid, omega, ends)
    if own is None:
        note = "not judged: it has other ports, several ticks, ticks and states besides, or no rest at the run's means"
        return LineError(name, kind, frequencies, nothing, bound, note)
    exact = np.asarray(part.two_port(omega, ends.p, ends.q, fluid))
    errors = scattering_error(own, exact)
    note, parts = "", None
    if errors.max() > bound:
        note, parts = instead_of(form, instance.written, library, fluid, omega, ends, exact, bound)
    return LineError(name, kind, frequencies, errors, bound, note, parts, above)


def _form(cls: type[Component], part: Component) -> Component:
    """The causal form of a line that the circuit chose, with the line's numbers."""
    return cls.model_construct(**{n: getattr(part, n) for n in type(part).model_fields})


def _passing(result: Result, name: str, period: float | None) -> tuple[Array, Ends]:
    """The strongest frequencies [Hz] at a line's ends, and the means there.

    Over the last period; without one over the second half of the run, where lines smear.
    """
    ports = ports_of(result.design.instances[name].component)
    names = [f"{name}.{port}.{v}" for v in ("p", "q") for port in ports]
    dense = Dense(result, names)
    span = (dense.stop - dense.start) / 2
    window = period if period is not None and period <= 2 * span else span
    found = spectra(result, names, window)
    hertz: set[float] = set()
    for each in found:
        strongest = each.strongest(MOST_FREQUENCIES)
        most = max((line.amplitude for line in strongest), default=0.0)
        hertz |= {line.frequency for line in strongest if line.amplitude >= STRONG * most}
    return np.array(sorted(hertz)), Ends(*(each.mean for each in found))
