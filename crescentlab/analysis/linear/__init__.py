"""Linear models of a circuit at an operating point: matrices, modes, frequency responses, impedances."""

from crescentlab.analysis.linear.model import (
    LinearModel,
    linear_model,
    linearize,
)

__all__ = ["LinearModel", "linear_model", "linearize"]
