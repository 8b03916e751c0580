"""Derivatives of outcomes by parameters: exact through events, by differences where that does not hold."""

from crescentlab.analysis.sensitivity.by_parameter import (
    METHODS,
    Sensitivities,
    in_units,
    sensitivities,
)

__all__ = ["METHODS", "Sensitivities", "in_units", "sensitivities"]
