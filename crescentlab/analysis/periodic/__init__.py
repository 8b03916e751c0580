"""The periodic steady state: the run that is the same after one period as before it."""

from crescentlab.analysis.periodic.shooting import (
    Periodic,
    periodic,
    whole_ticks,
)

__all__ = ["Periodic", "periodic", "whole_ticks"]
