"""System + numbers -> :class:`Trajectory`, by the loop that the solver's name asks for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from crescentlab.errors import CompilerError
from crescentlab.solvers import compiled, loop
from crescentlab.solvers.limits import PressureLimits
from crescentlab.solvers.options import TIGHT, Options
from crescentlab.solvers.snapshot import Snapshot
from crescentlab.solvers.trajectory import Trajectory
from crescentlab.system import System, Values

INSTEAD = {"rodas": "auto", "dopri": "rk45"}
"""The compiled methods, and what runs on a machine that cannot build them."""

Progress = Callable[[float], None] | None


def integrate(
    system: System, values: Values, options: Options, progress: Progress = None, start: Snapshot | None = None
) -> Trajectory:
    """Run the system; failures and interruptions end up in the trajectory's status, nothing is lost.

    With ``start`` the run goes on from there, and ``options.start`` and the start values are not read.

    ``auto`` begins with SciPy's LSODA or BDF. If the run turns out to need very many steps, and this machine can build
    the compiled loop, it is begun anew with ``rodas``: what decides is a count of steps, not a time, so that the same
    run goes the same way again.
    """
    done = _integrated(system, values, options, progress, start)
    done.warnings += PressureLimits(system, values.p).warnings(done.steps)
    return done


def _integrated(
    system: System, values: Values, options: Options, progress: Progress, start: Snapshot | None
) -> Trajectory:
    if start is not None:
        options, values = replace(options, start=start.t), start.values(values)
    if options.solver in INSTEAD:
        try:
            return compiled.integrate(system, values, options, progress, start)
        except CompilerError as error:
            other = replace(options, solver=INSTEAD[options.solver])
            done = loop.integrate(system, values, other, progress, start)
            done.warnings.insert(0, f"{options.solver} needs a C compiler, {done.solver} ran instead: {error}")
            return done
    if options.solver == "auto" and options.rtol >= TIGHT:
        try:
            return loop.integrate(system, values, options, progress, start, give_up=compiled.possible)
        except loop.TooManyStepsError:
            done = compiled.integrate(system, values, replace(options, solver="rodas"), progress, start)
            done.solver = f"auto: {done.solver}"
            return done
    return loop.integrate(system, values, options, progress, start)
