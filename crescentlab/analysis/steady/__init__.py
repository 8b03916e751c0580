"""The operating point of a circuit: where nothing changes any more."""

from crescentlab.analysis.steady.search import (
    Method,
    OperatingPoint,
    steady,
)
from crescentlab.analysis.steady.unrest import MovingError

__all__ = ["Method", "MovingError", "OperatingPoint", "steady"]
