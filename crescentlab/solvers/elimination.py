"""The static pattern of a sparse LU: which entries appear when I/(gamma h) - df/dx is eliminated without pivoting."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu


@dataclass(frozen=True)
class Elimination:
    """Rows in the order of elimination, each with its entries ascending: L left of the diagonal, U from it on."""

    order: np.ndarray
    """State eliminated k-th, shape (n,)."""
    row: np.ndarray
    """First entry of each row, shape (n + 1,)."""
    column: np.ndarray
    """Column of each entry, shape (entries,)."""
    diagonal: np.ndarray
    """Entry of each diagonal, shape (n,)."""
    place: np.ndarray
    """Entry of each nonzero of the Jacobian (by columns), shape (nonzeros,)."""


def elimination(pattern: sparse.csc_matrix) -> Elimination:
    """Order by minimum degree of A + A^T (SuperLU's), and the fill that it brings.

    SuperLU factorises a matrix of this pattern whose diagonal outweighs the rest, so that it does not pivot either.
    """
    n = pattern.shape[0]
    coo = pattern.tocoo()
    mirrored = sparse.csc_matrix((np.ones(2 * coo.nnz), (np.r_[coo.row, coo.col], np.r_[coo.col, coo.row])), (n, n))
    mirrored.data[:] = np.random.default_rng(1).uniform(0.1, 1.0, mirrored.nnz)
    heavy = sparse.diags_array(np.full(n, 2.0 * n))
    factors = splu(
        sparse.csc_matrix(mirrored + heavy), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )  # fmt: skip
    order = np.argsort(factors.perm_c)
    filled = sparse.csr_matrix(factors.L + factors.U)
    filled.eliminate_zeros()
    filled = sparse.csr_matrix(filled + filled.T)  # what pads SuperLU's blocks on one side
    filled.sort_indices()
    row, column = filled.indptr, filled.indices
    rows = np.repeat(np.arange(n), np.diff(row))
    entry = sparse.csr_matrix((np.arange(column.size) + 1, column, row), shape=(n, n))
    to = factors.perm_c
    place = np.asarray(entry[to[coo.row], to[coo.col]]).ravel().astype(np.int64) - 1 if coo.nnz else np.zeros(0, int)
    return Elimination(order, row, column, np.flatnonzero(rows == column), place)
