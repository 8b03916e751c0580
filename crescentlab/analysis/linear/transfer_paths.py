"""Whether an input acts on an output at all: a path in the graph of the matrices. A transfer is never silently zero."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import networkx as nx
import numpy as np

from crescentlab.errors import InputError

Array = np.ndarray
Node = tuple[str, int]


class Named(Protocol):
    """An input or an output."""

    @property
    def name(self) -> str:
        """As the user calls it."""


class Wired(Protocol):
    """What of a linear model says which input acts on which output."""

    @property
    def inputs(self) -> Sequence[Named]:
        """Inputs."""

    @property
    def outputs(self) -> Sequence[Named]:
        """Outputs."""

    @property
    def still(self) -> Sequence[str]:
        """States that do not move here."""

    @property
    def A(self) -> Array:
        """States on states."""

    @property
    def C(self) -> Array:
        """States on outputs."""

    @property
    def D(self) -> Array:
        """Inputs on outputs."""

    @property
    def driven(self) -> Array:
        """How much each input drives each state at all, shape (states, inputs)."""


def paths(model: Wired) -> Array:
    """Whether there is a path from each input to each output, bool, shape (outputs, inputs)."""
    graph: nx.DiGraph[Node] = nx.DiGraph()
    graph.add_nodes_from(("u", k) for k in range(len(model.inputs)))
    graph.add_nodes_from(("y", k) for k in range(len(model.outputs)))
    parts = ((model.A, "x", "x"), (model.driven, "u", "x"), (model.C, "x", "y"), (model.D, "u", "y"))
    for matrix, source, target in parts:
        graph.add_edges_from(((source, int(j)), (target, int(i))) for i, j in np.argwhere(matrix != 0))
    found = np.zeros((len(model.outputs), len(model.inputs)), bool)
    for k in range(len(model.inputs)):
        reached = nx.descendants(graph, ("u", k))
        found[:, k] = [("y", j) in reached for j in range(len(model.outputs))]
    return found


def check_paths(model: Wired) -> list[str]:
    """Refuse an input or an output that is cut off from all others; name every other pair that is."""
    if not model.inputs or not model.outputs:
        return []
    linked = paths(model)
    why = f"; here {', '.join(model.still[:4])} cannot move" if model.still else ""
    for k, u in enumerate(model.inputs):
        if not linked[:, k].any():
            outputs = " or ".join(y.name for y in model.outputs)
            raise InputError(f"input {u.name} does not act on {outputs} at this operating point: no path{why}")
    for k, y in enumerate(model.outputs):
        if not linked[k].any():
            inputs = " or ".join(u.name for u in model.inputs)
            raise InputError(f"output {y.name} does not follow {inputs} at this operating point: no path{why}")
    return [
        f"{model.inputs[j].name} does not act on {model.outputs[i].name} here: this transfer is zero{why}"
        for i, j in np.argwhere(~linked)
    ]
