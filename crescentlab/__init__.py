"""crescentlab: hydraulic circuits, written in YAML, become one global ODE.

.. code-block:: python

    import crescentlab as cl

    circuit = cl.load("crescent_pump")  # or a path
    result = circuit.simulate(stop="60 ms", parameters={"speed": "3000 rpm"})
    result["delivery.p"], result.time   # numpy, SI
    point = cl.steady(cl.load("relief_valve"))
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from crescentlab.analysis.linear import linearize
    from crescentlab.analysis.outcome import Outcome, Window
    from crescentlab.analysis.periodic import periodic
    from crescentlab.analysis.sensitivity import sensitivities
    from crescentlab.analysis.spectrum import spectra
    from crescentlab.analysis.steady import steady
    from crescentlab.circuit import Circuit, load
    from crescentlab.errors import CrescentlabError, InputError, SimulationError
    from crescentlab.result import Result

__all__ = [
    "Circuit", "CrescentlabError", "InputError", "Outcome", "Result", "SimulationError", "Window", "__version__",
    "linearize", "load", "periodic", "sensitivities", "spectra", "steady",
]  # fmt: skip

_HOMES = {
    "Circuit": "circuit", "load": "circuit", "Result": "result",
    "CrescentlabError": "errors", "InputError": "errors", "SimulationError": "errors",
    "Outcome": "analysis.outcome", "Window": "analysis.outcome", "linearize": "analysis.linear",
    "periodic": "analysis.periodic", "sensitivities": "analysis.sensitivity", "spectra": "analysis.spectrum",
    "steady": "analysis.steady",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import public names when they are first used, so that ``import crescentlab`` stays quick."""
    if name in _HOMES:
        import importlib

        return getattr(importlib.import_module(f"crescentlab.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'crescentlab' has no attribute {name!r}")
