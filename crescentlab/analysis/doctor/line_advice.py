"""What to write instead of a line that is too coarse: found by trying, the fewest cells that meet the bound."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from crescentlab.analysis.doctor.line_models import Ends, own_two_port, ports_of, scattering_error, tick_limit
from crescentlab.analysis.doctor.line_text import family_of, part_of, rewritten
from crescentlab.component import Component
from crescentlab.errors import CrescentlabError
from crescentlab.fluid import Fluid
from crescentlab.library import Library
from crescentlab.yaml_text import Node

Array = np.ndarray

MOST_PARTS = 64
GRIDS = ("internal_nodes", "lumps")
"""Fields that say into how many parts a line that ticks is cut."""
INSTEAD = "distributed_line"
"""The library's line of N cells inside the ODE, where it has one."""
CELLS = "cells"
"""Its number N, which is always written."""
TERMS, MORE_TERMS = "friction_terms", (10, 4)
"""Terms of a line's frequency-dependent friction that are tried if none is not enough."""
MOST_STATES = 800
"""Of a line that is tried."""


def instead_of(
    form: Component, text: Node, library: Library, fluid: Fluid, omega: Array, ends: Ends, exact: Array, bound: float
) -> tuple[str, int | None]:
    """What to write for a line that is too coarse and has this text, and how many cells or lumps it takes."""
    ticks = np.isfinite(tick_limit(form, fluid))
    if ticks and (found := _finer(form, fluid, omega, ends, exact, bound)):
        return found
    if found := _distributed(form, text, library, fluid, omega, ends, exact, bound):
        return found
    count = None if ticks else _fewest(lambda n: chain(form, n, fluid, omega, ends), 2, MOST_PARTS, exact, bound)
    if count is None:
        if ticks:
            return (
                f"neither {MOST_PARTS} nodes or lumps meet it nor a line of {MOST_PARTS} cells and {MORE_TERMS[0]} "
                "terms of friction: the frequencies are high for its length, or losses are missing",
                None,
            )
        return f"not even {MOST_PARTS} parts meet it: what is missing is no inertia or capacity, but losses", None
    each = part_of(text.find(("length",)), float(getattr(form, "length", 0.0)), count)
    return f"write {count} lines of type {family_of(type(form)).type_name()} in series, each {each} long", count


def _distributed(
    form: Component, text: Node, library: Library, fluid: Fluid, omega: Array, ends: Ends, exact: Array, bound: float
) -> tuple[str, int] | None:
    """The library's line of the fewest cells without terms of friction, else of the fewest states with some."""
    found: tuple[str, int] | None = None
    states = MOST_STATES
    for terms in (0, *MORE_TERMS):
        make, each = _cells_of(form, library, terms), 2 + terms
        if make is None:
            continue

        def cells(n: int, make: Callable[[int], Component] = make) -> Array | None:
            return own_two_port(make(n), fluid, omega, ends)

        most = min(MOST_PARTS, states // each)
        if most and _meets(cells(most), exact, bound):
            count = _fewest(cells, 1, most, exact, bound)
            assert count is not None
            found, states = (
                (f"write {rewritten(text, type(form), make(count), _changes(count, terms))}", count),
                count * each - 1,
            )
        if (found is None) == (terms > 0):
            break  # what fails with many terms fails with fewer; where none passes, none is needed
    return found


def _finer(
    form: Component, fluid: Fluid, omega: Array, ends: Ends, exact: Array, bound: float
) -> tuple[str, int] | None:
    """The same line that ticks, of more nodes or lumps, and more terms of friction where it has them; or None."""
    fields = type(form).model_fields
    grid = next((name for name in GRIDS if name in fields), None)
    if grid is None:
        return None
    own = getattr(form, TERMS, 0)
    for terms in (own, max(MORE_TERMS)) if TERMS in fields and own < max(MORE_TERMS) else (own,):
        added = {} if terms == own else {TERMS: terms}

        def finer(n: int, added: dict[str, int] = added) -> Array | None:
            line = form.model_copy(update={grid: n, **added})
            return own_two_port(line, fluid, omega, ends) if omega.max() <= tick_limit(line, fluid) else None

        count = _fewest(finer, 1, MOST_PARTS, exact, bound)
        # where friction is missing a coarse grid may pass by chance, its own damping in the place of it
        if count is not None and _meets(finer(min(2 * count, MOST_PARTS)), exact, bound):
            return "write " + ", ".join(f"{name}: {n}" for name, n in {grid: count, **added}.items()), count
    return None


def _changes(count: int, terms: int) -> dict[str, str]:
    """What the library's line of so many cells and terms of friction says of its own."""
    return {CELLS: str(count)} | ({TERMS: str(terms)} if terms else {})


def _meets(own: Array | None, exact: Array, bound: float) -> bool:
    return own is not None and float(scattering_error(own, exact).max()) <= bound


def _fewest(model: Callable[[int], Array | None], first: int, most: int, exact: Array, bound: float) -> int | None:
    """The fewest parts, from ``first`` to ``most``, that meet the bound, as the error falls with them."""
    low, high = first - 1, min(first, most)
    while not _meets(model(high), exact, bound):
        if high >= most:
            return None
        low, high = high, min(2 * high, most)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if _meets(model(middle), exact, bound) else (middle, high)
    return high


def _cells_of(form: Component, library: Library, terms: int) -> Callable[[int], Component] | None:
    """Makes the library's distributed line of n cells in place of a line, its ends as the line's; None without one."""
    cls = library.components.get(INSTEAD)
    if cls is None:
        return None
    roles = {p.name: p.role for p in type(form).ports()}
    forms = [f for f in cls.forms() if {p.name: p.role for p in f.ports()} == roles]
    if not forms or CELLS not in cls.model_fields:
        return None
    given = {n: getattr(form, n) for n in cls.model_fields if n in type(form).model_fields}
    if terms:
        if TERMS not in cls.model_fields:
            return None
        given[TERMS] = terms

    def make(cells: int) -> Component:
        return forms[0].model_validate({**given, CELLS: cells})

    try:
        make(2)
    except (ValueError, CrescentlabError):
        return None
    return make


def chain(form: Component, count: int, fluid: Fluid, omega: Array, ends: Ends) -> Array | None:
    """Two-port (m, 2, 2) of ``count`` equal parts in series, in the causal forms that then fit each other."""
    total: Array | None = None
    for k, cls in enumerate(_forms_in_series(form, count)):
        values = {n: getattr(form, n) for n in cls.model_fields if n in type(form).model_fields}
        values["length"] /= count
        if "loss_coefficient" in values:
            values["loss_coefficient"] /= count
        own = own_two_port(cls.model_construct(**values), fluid, omega, ends.part(k, count))
        if own is None:
            return None
        matrix = _chain_matrix(own)
        total = matrix if total is None else total @ matrix
    assert total is not None
    return _admittance(total)


def _forms_in_series(form: Component, count: int) -> Iterator[type[Component]]:
    """Forms whose neighbours fit: where one takes the pressure the next gives it."""
    ends = ports_of(form)
    family = {tuple(str(p.role) for p in f.ports() if p.name in ends): f for f in family_of(type(form)).forms()}
    a, b = (str(p.role) for p in type(form).ports() if p.name in ends)
    inner = {("takes", "takes"): ("gives", "takes"), ("gives", "gives"): ("takes", "gives")}.get((a, b), (a, b))
    for k in range(count):
        yield family[(a, b) if k == 0 else inner]


def _chain_matrix(y: Array) -> Array:
    """(p_a, q_a) from (p_b, -q_b), shape (m, 2, 2)."""
    y11, y12, y21, y22 = y[:, 0, 0], y[:, 0, 1], y[:, 1, 0], y[:, 1, 1]
    rows = [[-y22 / y21, -1 / y21], [y12 - y11 * y22 / y21, -y11 / y21]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def _admittance(matrix: Array) -> Array:
    a, b, c, d = matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 0], matrix[:, 1, 1]
    rows = [[d / b, c - a * d / b], [-1 / b, a / b]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
