"""System + numbers -> :class:`Trajectory`, by the loop that the solver's name asks for."""

from __future__ import annotations

from collections.abc import Callable

from crescentlab.solvers import loop
from crescentlab.solvers.options import Options
from crescentlab.solvers.trajectory import Trajectory
from crescentlab.system import System, Values

COMPILED = ("rodas", "dopri")
"""Methods of the compiled loop."""


def integrate(
    system: System, values: Values, options: Options, progress: Callable[[float], None] | None = None
) -> Trajectory:
    """Run the system; failures and interruptions end up in the trajectory's status, nothing is lost."""
    if options.solver in COMPILED:
        from crescentlab.solvers import compiled

        return compiled.integrate(system, values, options, progress)
    return loop.integrate(system, values, options, progress)
