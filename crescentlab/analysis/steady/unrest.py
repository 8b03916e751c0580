"""Says in the circuit's words why there is no operating point, or none that was found."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from crescentlab.analysis.steady.closed import Ledger
from crescentlab.analysis.steady.rest import Point, Site
from crescentlab.closed_sets import NAMED, some
from crescentlab.errors import InputError, MovingError
from crescentlab.units import QUANTITIES, Quantity

Array = np.ndarray
Unit = Callable[[Quantity], str]
"""The unit in which a quantity is shown."""

ROUNDING = 1e-9
"""Share of the largest term below which a sum counts as rounding."""
PROBES = (0.0, 0.0123, 0.317)
"""Times [s] after the present one at which dependence on the time is looked for, so that no extremum hides it."""


def check_drift(site: Site, point: Point, *, frozen: bool) -> str | None:
    """Raise :class:`InputError` if what counts on, the time included, changes the rates of what should come to rest.

    Counters of one quantity are summed, since only their differences matter. With ``frozen`` the time may change
    them: a warning is returned.
    """
    names, quantities = site.counters
    kinds = ["time" if q is None else q.name for q in quantities]
    moving: dict[str, Array] = {}
    for ahead in PROBES:
        slope, rates = site.drift(later(site, point, ahead), ahead)
        terms = slope.multiply(rates).tocsc()
        for kind in dict.fromkeys(kinds):
            own = terms[:, [k for k, each in enumerate(kinds) if each == kind]]
            net, size = np.asarray(own.sum(axis=1)).ravel(), np.asarray(abs(own).sum(axis=1)).ravel()
            changed = np.abs(net) > ROUNDING * size
            moving[kind] = moving.get(kind, np.zeros(net.size, dtype=bool)) | changed
    _, rates = site.drift(point)
    for kind, rows in moving.items():
        turning = [k for k in range(1, 1 + site.n_counting) if kinds[k] == kind and rates[k] != 0]
        if kind != "time" and rows.any() and turning:
            raise InputError(_turning(site, names, quantities, rates, turning, rows))
    if not moving["time"].any():
        return None
    said = f"the time itself{_timed(site)} changes {_listed(site, moving['time'])}"
    if frozen:
        return f"{said}; the circuit would come to rest here if the time stood still at {site.t:g} s"
    raise MovingError(
        f"there is no steady state: {said}",
        "let the time stand still (crescentlab steady --at T), or use crescentlab periodic if the circuit repeats "
        "itself",
    )


def later(site: Site, point: Point, ahead: float) -> Point:
    """The point with everything that counts moved on by ``ahead`` [s], at its present rate."""
    if not ahead:
        return point
    _, rates = site.drift(point)
    x, h = point.x.copy(), point.h.copy()
    x[site.system.counting_states] += ahead * rates[1 : 1 + site.n_counting]
    h[site.system.counting_held] += ahead * rates[1 + site.n_counting :]
    return Point(x, h, point.b, point.holds)


def _turning(
    site: Site, names: list[str], quantities: list[Quantity | None], rates: Array, turning: list[int], rows: Array
) -> str:
    k = max(turning, key=lambda k: abs(rates[k]))
    quantity, rate = quantities[k], float(rates[k])
    if quantity is QUANTITIES["angle"]:
        moves = f"turns at {QUANTITIES['speed'].show(rate, 'rpm', 4)}"
    else:
        moves = f"changes at {quantity.show(rate, None, 4)}/s" if quantity is not None else "goes on"
    return (
        f"there is no steady state: {names[k]} {moves}, and {_listed(site, rows)} "
        f"{'follow' if rows.sum() > 1 else 'follows'} it; crescentlab periodic finds the state that repeats itself"
    )


def _timed(site: Site) -> str:
    """The components that the time comes in through: signals."""
    asking = timed(site)
    return f" (through {', '.join(asking[:NAMED])})" if asking else ""


def timed(site: Site) -> list[str]:
    """Names of the components that ask for the time and do not tick."""
    ticked = {event.name.rpartition(".")[0] for event in site.system.events if event.kind == "every"}
    return [n for n, c in site.system.plan.components.items() if "t" in type(c).asks_for() and n not in ticked]


def _listed(site: Site, rows: Array) -> str:
    """The rates of these unknowns in words."""
    return f"the rate{'s' if rows.sum() > 1 else ''} of {some([site.names[k] for k in np.flatnonzero(rows)])}"


def resisting(site: Site, point: Point, ledger: Ledger, unit: Unit) -> str:
    """The rates that are largest in their unknowns' own sizes, and volumes fed without a way out."""
    F, _ = site.rates(point)
    speed = np.abs(F) / site.scale(site.unknowns(point))
    worst = [int(k) for k in np.argsort(-speed)[:NAMED] if speed[k] > 0]
    shown = ", ".join(f"{site.names[k]} ({site.show_rate(k, float(F[k]), unit)})" for k in worst)
    said = f"what resists most: {shown}" if shown else "nothing resists, but the equations depend on each other"
    ways = ledger.sets.without_way_out(site.t, point.x, point.h, point.b, unit)
    return "; ".join([said, *ways])
