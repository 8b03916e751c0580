"""Every figure that the pages of the components print: computed and expected agree within the stated tolerance."""

from __future__ import annotations

import pytest
from evidence import Case, cases

CASES = cases()


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_figures_agree_with_their_source(case: Case) -> None:
    """The source, the tolerance and the reason for it are the case's own."""
    assert case.title
    assert case.source
    assert case.because
    numbers = case.compute()
    assert numbers
    for number in numbers:
        assert number.error <= case.tolerance, f"{number.what}: {number.computed} instead of {number.expected}"
