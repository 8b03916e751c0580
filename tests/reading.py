"""Values of a run at its own rows, without interpolation between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from crescentlab.result import Result


def rows(result: Result, name: str, times: Sequence[float] | np.ndarray) -> np.ndarray:
    """Values at times that stand in the result, each the last of its instant."""
    places = np.searchsorted(result.time, np.asarray(times) + 1e-12) - 1
    np.testing.assert_allclose(result.time[places], times, rtol=0, atol=1e-12)
    return np.asarray(result[name][places])
