"""Newton's equations of a mesh as one matrix that is kept: solved for many right sides, transposed, and with borders.

    A delta = b,     A = dF / dy     (12 (N + 1) equations and unknowns)                             (1)

F holds the conditions of the start, the gaps of the elements and the equations of the joints, the conditions of the end; the
unknowns of a node are (dr, phi, dn, dm), see `kernels/collocation.py`.

Source: W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (SIAM, 2000), chapter 3 (borders).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from darboux.kernels import bordered as kernel
from darboux.kernels import response as response_kernel
from darboux.kernels.bordered import HALF, Borders, Matrix, new_factors
from darboux.kernels.rod_equations import STATES
from darboux.kernels.system import FREE, SIDES
from darboux.statics.collocation_equations import Equations
from darboux.statics.mesh import Mesh

Array = NDArray[np.float64]

ROUNDS = 3  # of a search for null vectors: each uses the last one's as borders


class Linearised:
    """The equations of a mesh at a load factor about its states.

    ``residual`` F (n,) and ``by_load_factor`` dF / d lambda (n,), with n = 12 (N + 1); ``response`` (N, 12, 13 stages), how the
    elements' gaps answer to slopes at their stages. The stages of the mesh are those of an equilibrium, or near to it.
    """

    def __init__(self, equations: Equations, mesh: Mesh, load_factor: float = 1.0, responds: bool = True) -> None:
        N = len(mesh.x) - 1
        self.equations, self.mesh, self.load_factor = equations, mesh, load_factor
        self.system, self.supports = equations.system(mesh, load_factor), equations.supports(load_factor)
        self.matrix = Matrix(np.empty(HALF * FREE), np.empty(N * FREE * 2 * FREE), np.empty(HALF * FREE))
        sides = np.empty(((N + 1) * FREE, SIDES))
        self.response = np.empty((N, FREE, STATES * mesh.stages) if responds else (0, FREE, STATES * mesh.stages))
        response_kernel.linearise(self.system, self.supports, self.matrix, sides.ravel(), self.response.ravel())
        self.residual, self.by_load_factor = -sides[:, 0], -sides[:, 1]

    @property
    def size(self) -> int:
        """How many equations and unknowns there are."""
        return len(self.residual)

    @cached_property
    def plain(self) -> Bordered:
        """The matrix without borders."""
        return self.bordered(np.empty((self.size, 0)), np.empty((0, self.size)))

    def bordered(self, columns: Array, rows: Array, corner: Array | None = None) -> Bordered:
        """Return the matrix with borders: columns (n, k), rows (k, n), and a corner (k, k), zero unless given."""
        return Bordered(self.matrix, columns, rows, np.zeros((len(rows), len(rows))) if corner is None else corner)

    def dense(self) -> Array:
        """Return the matrix A (n, n), for tests and small meshes."""
        A, blocks = np.zeros((self.size, self.size)), self.matrix.blocks.reshape(-1, FREE, 2 * FREE)
        A[:HALF, :FREE], A[-HALF:, -FREE:] = self.matrix.start.reshape(HALF, FREE), self.matrix.end.reshape(HALF, FREE)
        for i, block in enumerate(blocks):
            A[HALF + i * FREE : HALF + (i + 1) * FREE, i * FREE : (i + 2) * FREE] = block
        return A

    def null_vectors(self, k: int) -> tuple[Array, Array, Array]:
        """Return right and left null vectors (n, k) of a matrix whose kernel has at most k dimensions, and tau (k, k).

            [A   B] [V  ]   [0]         [A^T  C^T] [W]   [0]
            [C   0] [tau] = [1],        [B^T   0 ] [.] = [1],        then B = W, C = V^T, orthonormal

        tau is 0 where the kernel has k dimensions; V then spans it, and W that of A^T. At a change of sign of det tau A turns
        singular.
        """
        rng = np.random.default_rng(0)
        right, left = (np.linalg.qr(rng.normal(size=(self.size, k)))[0] for _ in range(2))
        unit, tau = np.concatenate([np.zeros((self.size, k)), np.eye(k)]), np.eye(k)
        for _ in range(ROUNDS):
            found = self.bordered(left, right.T)
            x, z = found.solve(unit), found.solve_transposed(unit)
            tau = x[self.size :]
            (right, by), left = np.linalg.qr(x[: self.size]), np.linalg.qr(z[: self.size])[0]
            tau = tau @ np.linalg.inv(by)
        return right, left, tau


class Bordered:
    """A matrix with k borders, factored: M = [A B; C D].

    ``pivot`` is the least of the last pivots over the largest, with the sign of det M: near 0 where M is almost singular.
    """

    def __init__(self, matrix: Matrix, columns: Array, rows: Array, corner: Array) -> None:
        k, elements = len(rows), matrix.blocks.size // (2 * FREE * FREE)
        self.factors = new_factors(elements, k)
        flat = [np.ascontiguousarray(part, dtype=float).ravel() for part in (columns, rows, corner)]
        self.pivot = float(kernel.factor(matrix, Borders(*flat), self.factors))
        self.size = (elements + 1) * FREE + k

    def solve(self, b: Array) -> Array:
        """Return x (n + k, m) of M x = b (n + k, m)."""
        b = np.ascontiguousarray(b, dtype=float)
        x = np.empty_like(b)
        kernel.solve(self.factors, b.ravel(), x.ravel())
        return x

    def solve_transposed(self, c: Array) -> Array:
        """Return z (n + k, m) of M^T z = c (n + k, m)."""
        c = np.ascontiguousarray(c, dtype=float)
        z = np.empty_like(c)
        kernel.solve_transposed(self.factors, c.ravel(), z.ravel())
        return z
