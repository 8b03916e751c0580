"""The operating point of a circuit: where nothing changes any more."""

from crescentlab.analysis.steady.search import (
    Method,
    OperatingPoint,
    steady,
)

__all__ = ["Method", "OperatingPoint", "steady"]
