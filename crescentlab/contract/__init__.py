"""What must hold for every component class, as checks: of the library's classes, and of a user's own.

.. code-block:: python

    from crescentlab.contract import check_component

    def test_contract():
        check_component(MyOrifice(area=5e-6), SimpleOil(...))

A check raises :class:`ContractError` that says which class breaks what. Where numbers are needed they are random
admissible ones, of the size that their quantities usually have, and the same in every run.
"""

from __future__ import annotations

from collections.abc import Mapping

from crescentlab.component import Component
from crescentlab.contract.case import Case, sample
from crescentlab.contract.checks import (
    Backwards,
    check_content,
    check_documented,
    check_energy,
    check_floats_equal_symbols,
    check_fluid,
    check_jacobian,
    check_reaction,
    check_restriction,
)
from crescentlab.energy import fluids_asked
from crescentlab.errors import ArgumentError
from crescentlab.fluid import Fluid

__all__ = [
    "Backwards", "Case", "check_component", "check_content", "check_documented", "check_energy",
    "check_floats_equal_symbols", "check_fluid", "check_jacobian", "check_reaction", "check_restriction", "sample",
]  # fmt: skip


def check_component(
    component: Component | type[Component],
    *fluids: Fluid,
    backwards: Backwards = "equal",
    within: Mapping[str, tuple[float, float]] | None = None,
) -> None:
    """Run every check of this module; raises :class:`ContractError` naming the class and what it breaks.

    ``component`` is an instance with sensible numbers, or a class, whose required parameters then get the usual size
    of their quantity. Equations that ask for a fluid are checked with each of ``fluids``. ``backwards`` says what a
    restriction between two nets passes backwards. ``within`` narrows what is drawn: the range in SI of a state, held
    value or port input by its name in ``equations``, where the equations do not hold for any value of the usual size.
    """
    cls = component if isinstance(component, type) else type(component)
    for one in [sample(form) for form in cls.forms()] if isinstance(component, type) else [component]:
        check_documented(type(one))
        if fluids_asked(type(one)) and not fluids:
            raise ArgumentError(
                f"{cls.__name__} asks for a fluid; write check_component({cls.__name__}, SimpleOil(...))"
            )
        for fluid in fluids or (None,):
            case = Case(one, fluid, within or {})
            check_floats_equal_symbols(case)
            check_jacobian(case)
            if case.stored:
                check_content(case)
            if case.restricts:
                check_restriction(case, backwards)
            if case.keeps_books:
                check_energy(case)
            if case.between_bodies:
                check_reaction(case)
