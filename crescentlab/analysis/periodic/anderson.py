"""Anderson acceleration of a fixed-point iteration z -> P(z) that is expensive and a little noisy.

.. math:: z_{k+1} = P(z_k) - \\sum_j \\gamma_j \\Delta P_j, \\qquad
          \\gamma = \\arg\\min \\lVert r_k - \\sum_j \\gamma_j \\Delta r_j \\rVert, \\quad r = P(z) - z

Source: D. G. Anderson, J. ACM 12 (1965) 547; type II in the words of Walker & Ni, SIAM J. Numer. Anal. 49 (2011) 1715.
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray


class Anderson:
    """Proposes the next iterate from those seen; all vectors (n,) are scaled so that 1 is their usual size."""

    def __init__(self, memory: int, noise: float) -> None:
        """``memory``: iterates kept; ``noise``: what the map does not repeat; smaller differences say nothing."""
        self.memory, self.noise = memory, noise
        self.z: list[Array] = []
        self.p: list[Array] = []

    def forget(self) -> None:
        """Begin anew from the last iterate."""
        del self.z[:-1], self.p[:-1]

    def next(self, z: Array, p: Array) -> Array:
        """The iterate after z, whose image is p."""
        self.z.append(z)
        self.p.append(p)
        del self.z[: -self.memory - 1], self.p[: -self.memory - 1]
        gamma = self.weights()
        return p if gamma is None else p - np.diff(self.p, axis=0).T @ gamma

    def weights(self) -> Array | None:
        """Weights of the differences; None while there are none. Directions drowned by noise are left out."""
        if len(self.z) < 2:
            return None
        residuals = np.array(self.p) - np.array(self.z)
        u, s, vt = np.linalg.svd(np.diff(residuals, axis=0).T, full_matrices=False)
        kept = s > max(self.noise * np.sqrt(residuals.shape[1]), 1e-12 * s[0])
        if not kept.any():
            return None
        gamma: Array = vt[kept].T @ ((u[:, kept].T @ residuals[-1]) / s[kept])
        return gamma

    def multiplier(self) -> float:
        """Largest magnitude among the eigenvalues of P's derivative, on the space of the differences seen."""
        if len(self.z) < 2:
            return float("nan")
        dz, dp = np.diff(self.z, axis=0).T, np.diff(self.p, axis=0).T
        u, s, vt = np.linalg.svd(dz, full_matrices=False)
        kept = s > max(self.noise * np.sqrt(dz.shape[0]), 1e-12 * s[0])
        if not kept.any():
            return float("nan")
        return float(np.abs(np.linalg.eigvals(u[:, kept].T @ dp @ vt[kept].T / s[kept])).max())
