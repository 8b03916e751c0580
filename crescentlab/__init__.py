"""crescentlab: hydraulic circuits, written in YAML, become one global ODE.

.. code-block:: python

    import crescentlab as cl

    circuit = cl.load("crescent_pump")  # or a path
    result = circuit.simulate(stop="60 ms", parameters={"speed": "3000 rpm"})
    result["delivery.p"], result.time   # numpy, SI
    point = cl.steady(cl.load("relief_valve"))

Each command that asks something of a circuit is a function of the same name: ``steady``, ``periodic``, ``linearize``,
``spectrum``, ``doctor``, ``sensitivity``, ``study``, ``fit``. ``read`` gives a result back from its file. Numbers are
in SI wherever text would carry a unit. Whatever is wrong raises a :class:`CrescentlabError`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from crescentlab.analysis.doctor import examine as doctor
    from crescentlab.analysis.linear import linearize
    from crescentlab.analysis.outcome import Outcome, Window
    from crescentlab.analysis.periodic import periodic
    from crescentlab.analysis.sensitivity import sensitivities as sensitivity
    from crescentlab.analysis.spectrum import spectra as spectrum
    from crescentlab.analysis.steady import steady
    from crescentlab.circuit import Circuit, load
    from crescentlab.errors import (
        ArgumentError,
        CausalityError,
        CompilerError,
        ComponentError,
        ContractError,
        CrescentlabError,
        ExpressionError,
        InputError,
        MovingError,
        SimulationError,
        UnitError,
    )
    from crescentlab.recorded import read
    from crescentlab.result import Result
    from crescentlab.studies.run_fit import fit
    from crescentlab.studies.run_study import study

__all__ = [
    "ArgumentError", "CausalityError", "Circuit", "CompilerError", "ComponentError", "ContractError",
    "CrescentlabError", "ExpressionError", "InputError", "MovingError", "Outcome", "Result", "SimulationError",
    "UnitError", "Window", "__version__", "doctor", "fit", "linearize", "load", "periodic", "read", "sensitivity",
    "spectrum", "steady", "study",
]  # fmt: skip

_HOMES = {
    "Circuit": "circuit:Circuit", "load": "circuit:load", "read": "recorded:read", "Result": "result:Result",
    "Outcome": "analysis.outcome:Outcome", "Window": "analysis.outcome:Window",
    "steady": "analysis.steady:steady", "periodic": "analysis.periodic:periodic",
    "linearize": "analysis.linear:linearize", "spectrum": "analysis.spectrum:spectra",
    "doctor": "analysis.doctor:examine", "sensitivity": "analysis.sensitivity:sensitivities",
    "study": "studies.run_study:study", "fit": "studies.run_fit:fit",
    **{name: f"errors:{name}" for name in __all__ if name.endswith("Error")},
}  # fmt: skip
"""Where public names live, a module and its own name there."""

_FORMER = {"sensitivities": "sensitivity", "spectra": "spectrum"}
"""Names of release 0.1, and what they are called now."""


def __getattr__(name: str) -> Any:
    """Import public names when they are first used, so that ``import crescentlab`` stays quick."""
    import importlib

    if name in _FORMER:
        import warnings

        said = f"crescentlab.{name} is now crescentlab.{_FORMER[name]}; the old name goes with the next release"
        warnings.warn(said, DeprecationWarning, stacklevel=2)
        name = _FORMER[name]
    if name in _HOMES:
        module, _, own = _HOMES[name].partition(":")
        return getattr(importlib.import_module(f"crescentlab.{module}"), own)
    raise AttributeError(f"module 'crescentlab' has no attribute {name!r}")


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
