"""crescentlab: hydraulic circuits, written in YAML, become one global ODE.

.. code-block:: python

    import crescentlab as cl

    circuit = cl.load("crescent_pump")  # or a path
    result = circuit.simulate(stop="60 ms", parameters={"speed": "3000 rpm"})
    result["delivery.p"], result.time   # numpy, SI
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from crescentlab.circuit import Circuit, load
    from crescentlab.errors import CrescentlabError, InputError, SimulationError
    from crescentlab.result import Result

__all__ = ["Circuit", "CrescentlabError", "InputError", "Result", "SimulationError", "__version__", "load"]

_HOMES = {
    "Circuit": "circuit", "load": "circuit", "Result": "result",
    "CrescentlabError": "errors", "InputError": "errors", "SimulationError": "errors",
}  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import public names when they are first used, so that ``import crescentlab`` stays quick."""
    if name in _HOMES:
        import importlib

        return getattr(importlib.import_module(f"crescentlab.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'crescentlab' has no attribute {name!r}")
