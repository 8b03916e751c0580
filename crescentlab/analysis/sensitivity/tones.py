"""Outcomes whose frequency a parameter moves: a fixed window then holds no whole periods, and they have no derivative.

Beside f the Fourier integral over n periods of it sees the mean: a derivative would hold mean times d(n)/da, which is
of the window and not of the circuit.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence

from crescentlab.analysis.outcome import Outcome, Window, frequency_of, functions, lookup
from crescentlab.analysis.reach import STEP, Parameter, Reaching
from crescentlab.elaborate import Design
from crescentlab.errors import InputError
from crescentlab.expressions import Value, evaluate

ROUNDING = 1e-12
"""Relative difference of two evaluations of the same frequency."""
STAYS = 1e-5
"""Relative change of a frequency made of variables, per relative change of a parameter, that is the run's noise."""


def check_tones(
    window: Window, outcomes: Sequence[Outcome], parameters: Sequence[Parameter], reaching: Reaching
) -> None:
    """Raise :class:`InputError` where the frequency of an ``amplitude`` depends on a parameter."""
    for outcome in outcomes:
        if "amplitude" not in outcome.text:
            continue
        present = tones(window, outcome, window.design)
        for parameter in parameters:
            step = (
                STEP * parameter.size * (-1.0 if reaching.sides(parameter, STEP * parameter.size) == "backward" else 1)
            )
            moved = tones(window, outcome, reaching.varied(parameter, parameter.value + step))
            for before, after in zip(present, moved, strict=True):
                if abs(after - before) > ROUNDING * abs(before):
                    raise refusal(outcome, parameter, window, before)


def refusal(outcome: Outcome, parameter: Parameter, window: Window, tone: float) -> InputError:
    """Says that a parameter moves the frequency ``tone`` [Hz] of an outcome's amplitude."""
    return InputError(
        f"{outcome.name}: {parameter.name} moves the frequency of this amplitude, and the window of "
        f"{window.length:g} s would no longer hold whole periods; the frequency must not depend on the parameter: "
        f"write it as a number, {tone:.9g} Hz, for the line that stays there, or leave --parameter "
        f"{parameter.name} out",
        outcome.place,
    )


def tones(window: Window, outcome: Outcome, design: Design) -> list[float]:
    """Frequencies [Hz] of the amplitudes in an outcome, with the circuit parameters of ``design``."""
    found: list[float] = []
    other = copy.copy(window)
    other.design = design

    def amplitude(arguments: list[Value]) -> Value:
        found.append(frequency_of(arguments[1]))
        return Value(1.0, arguments[0].quantity)

    evaluate(outcome.text, lookup(other), {**functions(other), "amplitude": amplitude})
    return found
