"""The ledger of stored fluid: what flowed in against what is stored more, per component.

.. math:: \\varepsilon = \\frac{\\left|\\int \\sum q \\, dt - \\Delta S\\right|}{\\max_i \\int \\sum |q_i| / 2 \\, dt}

The divisor is no less than a millionth of the largest S: at rest nothing flows but what the solver's tolerance leaves.

S [m^3 at 0 bar gauge] is what the component's own law stores (its ``stores()`` observable). Jumps of S
at events are booked apart as ``merged``: volumes that are merged or parted take their content along.
The integral uses the solver's own interpolant at three Gauss nodes per smooth piece.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from crescentlab.solvers.trajectory import GAUSS_NODES, GAUSS_WEIGHTS, Trajectory
from crescentlab.system import System, Values

AT_REST = 1e-6
"""Where less than this share of the largest content flows, errors are told as shares of that much."""


@dataclass(frozen=True)
class Balance:
    """Relative errors per storing component and for the circuit, and content moved by events [m^3]."""

    components: dict[str, float]
    circuit: float
    merged: dict[str, float]

    def as_json(self) -> dict[str, object]:
        """Plain data for ``--json``."""
        return {
            "circuit": self.circuit,
            "components": self.components,
            "merged": {k: v for k, v in self.merged.items() if v},
        }


def balance(system: System, values: Values, trajectory: Trajectory) -> Balance | None:
    """Compute the ledger; None if nothing stores or no step was made."""
    contents = system.contents()
    pieces = trajectory.pieces
    if not contents or not len(pieces.low):
        return None
    stored = ca.Function("S", system.arguments, [ca.vertcat(*[c for c, _, _ in contents.values()])])
    flows = ca.Function(
        "Q",
        system.arguments,
        [ca.vertcat(*[q for _, q, _ in contents.values()]), ca.vertcat(*[m for _, _, m in contents.values()])],
    )
    low, high = np.array(pieces.low), np.array(pieces.high)
    into = np.zeros((len(contents), low.size))
    size = np.zeros_like(into)
    h, b = np.array(pieces.h).T, np.array(pieces.b).T
    x = pieces.at_nodes()
    for node, weight in enumerate(GAUSS_WEIGHTS):
        # relations that compare time read it from frozen bits, so the node's own time serves signals
        t = low + (high - low) * GAUSS_NODES[node]
        q, m = flows(t.reshape(1, -1), x[:, node, :].T, h, b, values.p)
        into += weight * np.array(q) * (high - low)
        size += weight * np.array(m) * (high - low)
    t, xs, hs, bs = trajectory.steps.arrays()
    content = np.array(stored(t.reshape(1, -1), xs.T, hs.T, bs.T, values.p))
    jumps = trajectory.steps.jumps
    moved = content[:, jumps] - content[:, jumps - 1] if jumps.size else np.zeros((len(contents), 0))
    change = content[:, -1] - content[:, 0] - moved.sum(axis=1)
    largest = max(float(size.sum(axis=1).max()), AT_REST * float(np.abs(content).max()), 1e-300)
    error = into.sum(axis=1) - change
    names = list(contents)
    return Balance(
        {n: float(abs(e) / largest) for n, e in zip(names, error, strict=True)}, float(abs(error.sum()) / largest),
        {n: float(v) for n, v in zip(names, np.abs(moved).sum(axis=1), strict=True)},
    )  # fmt: skip
