"""Linear systems of the static solve: who is unknown, the matrix from pieces, and three solvers.

A *piece* is the stiffness of an element or a joint. `Direct` brings all pieces to rank 0, puts them together in the
order of their numbers and factorises there (SciPy's SuperLU): what comes out has the same bits on any number of ranks.
`Petsc` shares the rows out as nodes are owned, for models whose factors are too large for one rank.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcdem.core.comm import Comm
from hpcdem.core.errors import CommandError

MANY = 400_000
"""Number of unknowns from which PETSc is used if it is installed: SuperLU then needs minutes and several GB on one
rank."""
MANY_IN_SPACE = 20_000
"""Number of unknowns from which PETSc is used in space, where the factors fill in earlier."""
COARSEST = 1500
"""Unknowns up to which multigrid solves its coarsest grid directly: more levels, as by default of PETSc (50), need more
iterations, and the more the more ranks there are."""
CONDENSED = 2000
"""Largest number of unknowns of joints and fluid for which dense matrices are used."""
SINGULAR = (
    "the stiffness matrix is singular: part of the model can move without resistance (an open joint without tensile "
    "strength, or properties that differ by more than 1e15)"
)


@dataclass
class Pieces:
    """key (m,): numbers in the mesh, ascending on one rank after the other; node (m, k); stiffness (m, dim k,
    dim k)."""

    key: np.ndarray
    node: np.ndarray
    stiffness: np.ndarray

    @staticmethod
    def joined(parts: list[Pieces]) -> Pieces:
        """Join all pieces of one kind, in the order of their numbers."""
        key = np.concatenate([part.key for part in parts])
        order = np.argsort(key, kind="stable")
        node = np.concatenate([part.node for part in parts])[order]
        return Pieces(key[order], node, np.concatenate([part.stiffness for part in parts])[order])


@dataclass
class Unknowns:
    """Degrees of freedom of nodes. number (nn, dim): of the unknowns of a node along basis[:, :, k], -1: none there;
    given (nn, dim) [m]: prescribed movement."""

    number: np.ndarray
    basis: np.ndarray
    given: np.ndarray
    oblique: np.ndarray
    """(nn,) bool: nodes whose constrained directions are not the axes."""

    @property
    def count(self) -> int:
        return int((self.number >= 0).sum())

    def reduced(self, force: np.ndarray) -> np.ndarray:
        """Forces (nn, dim) on nodes as right-hand side (n,)."""
        along = np.einsum("nck,nc->nk", self.basis, force)
        out = np.empty(self.count)
        known = self.number >= 0
        out[self.number[known]] = along[known]
        return out

    def moved(self, q: np.ndarray, share: float) -> np.ndarray:
        """Movements (nn, dim) [m] from the unknowns, and this share of what is prescribed."""
        along = np.where(self.number >= 0, q[self.number], 0.0) if len(q) else np.zeros(self.number.shape)
        out = np.where(self.oblique[:, None], np.einsum("nck,nk->nc", self.basis, along), along)
        return out + share * self.given

    def entries(self, pieces: list[Pieces]) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Rows, columns and values of the matrix; rows and values of its product with the prescribed movements."""
        rows, columns, values, of_rows, of_values = [], [], [], [], []
        some_given = bool(self.given.any())
        dim = self.number.shape[1]
        for one in pieces:
            m, k = one.node.shape
            stiffness = one.stiffness.reshape(m, k, dim, k, dim)
            turned = np.flatnonzero(self.oblique[one.node].any(axis=1))
            number = self.number[one.node].reshape(m, dim * k)
            if len(turned):
                basis = self.basis[one.node[turned]]
                half = np.einsum("mkca,mkcjd->mkajd", basis, stiffness[turned])
                stiffness = stiffness.copy()
                stiffness[turned] = np.einsum("mkajd,mjdb->mkajb", half, basis)
            if some_given:
                # The columns of prescribed movements count along the axes; only the rows are turned.
                untouched = one.stiffness.reshape(m, k, dim, k, dim).copy()
                if len(turned):
                    untouched[turned] = half
                product = np.einsum("mkajd,mjd->mka", untouched, self.given[one.node]).reshape(m, dim * k)
                of_rows.append(number[number >= 0])
                of_values.append(product[number >= 0])
            full = stiffness.reshape(m, dim * k, dim * k)
            keep = (number >= 0)[:, :, None] & (number >= 0)[:, None, :]
            rows.append(np.broadcast_to(number[:, :, None], keep.shape)[keep])
            columns.append(np.broadcast_to(number[:, None, :], keep.shape)[keep])
            values.append(full[keep])
        nothing = np.empty(0, np.int64)
        return (
            np.concatenate([nothing, *rows]),
            np.concatenate([nothing, *columns]),
            np.concatenate([np.empty(0), *values]),
            np.concatenate([nothing, *of_rows]),
            np.concatenate([np.empty(0), *of_values]),
        )


def rigid_movements(arm: np.ndarray) -> np.ndarray:
    """Movements (n, dim, modes) of points at `arm` (n, dim): along each axis, then about the axis across the plane, in
    space about x, y and z."""
    n, dim = arm.shape
    turns = ((0, 1),) if dim == 2 else ((1, 2), (2, 0), (0, 1))
    out = np.zeros((n, dim, dim + len(turns)))
    out[:, range(dim), range(dim)] = 1.0
    for k, (i, j) in enumerate(turns):
        out[:, i, dim + k], out[:, j, dim + k] = -arm[:, j], arm[:, i]
    return out


def _on_first(comm: Comm, pieces: list[Pieces], take: Callable[[list[Pieces]], str | None]) -> None:
    """Rank 0 takes all pieces, in the order of their numbers. CommandError on all ranks with what it says is wrong."""
    parts = comm.gather(pieces) or []
    error = take([Pieces.joined(list(of)) for of in zip(*parts)]) if comm.rank == 0 else None
    if (error := comm.bcast(error)) is not None:
        raise CommandError(error)


class Direct:
    """Factors on rank 0, by SciPy. flows: of a matrix with plastic flow, which need not be nearly symmetric: rows are
    exchanged where the diagonal is small."""

    name = "direct (SciPy)"
    flows = False

    def __init__(self, comm: Comm, unknowns: Unknowns, owner: np.ndarray) -> None:
        self.comm, self.unknowns = comm, unknowns
        self._factors: Any = None
        self._coupling: Any = np.empty(0)

    def factor(self, pieces: list[Pieces]) -> None:
        """Take the pieces of this rank. CommandError if the matrix is singular. Collective."""
        _on_first(self.comm, pieces, self._factor)

    def _factor(self, pieces: list[Pieces]) -> str | None:
        from scipy.sparse import coo_matrix
        from scipy.sparse.linalg import splu

        n = self.unknowns.count
        rows, columns, values, of_rows, of_values = self.unknowns.entries(pieces)
        self._coupling = np.bincount(of_rows, of_values, n) if len(of_rows) else np.zeros(n)
        if not n:
            return None
        matrix = coo_matrix((values, (rows.astype(np.int32), columns.astype(np.int32))), (n, n)).tocsc()
        # Stiffness is nearly symmetric with a large diagonal: no rows need to be exchanged, and the ordering for
        # symmetric patterns fills in least. Scaling by the diagonal makes stiff joints and soft rock alike.
        diagonal = np.abs(matrix.diagonal()) if self.flows else matrix.diagonal()
        if not (np.isfinite(matrix.data).all() and (diagonal > 0.0).all()):
            return SINGULAR
        self._scale = 1.0 / np.sqrt(diagonal)
        matrix.data *= np.repeat(self._scale, np.diff(matrix.indptr)) * self._scale[matrix.indices]
        try:
            self._factors = splu(matrix, "MMD_AT_PLUS_A", 0.1 if self.flows else 0.0, options={"SymmetricMode": True})
        except RuntimeError:
            return SINGULAR
        except MemoryError:
            return f"the factors of {n} unknowns do not fit into memory: use PETSc and more ranks, or relaxation"
        return None

    def solve(self, force: np.ndarray, share: float) -> np.ndarray:
        """Movements (nn, dim) [m] that undo the unbalanced forces (nn, dim), with this share of what is prescribed;
        equal on all ranks. Collective."""
        moved = None
        if self.comm.rank == 0:
            q = self.unknowns.reduced(force) - share * self._coupling
            if len(q):
                q = self._scale * self._factors.solve(self._scale * q)
            moved = self.unknowns.moved(q, share)
        return self.comm.bcast(moved)

    def close(self) -> None:
        """Do nothing: no resources outside of Python."""


class Condensed:
    """Static condensation on rank 0: what the elements bring is eliminated once, down to the nodes of joints and fluid,
    and only there is the matrix made again (Guyan 1965; exact here). For few such nodes between many elements."""

    name = "direct (SciPy), condensed onto joints"
    flows = True

    def __init__(self, comm: Comm, unknowns: Unknowns, nodes: np.ndarray) -> None:
        """nodes: those of joints and fluid."""
        self.comm, self.unknowns = comm, unknowns
        number = unknowns.number[np.unique(nodes)].reshape(-1)
        self._kept = number[number >= 0]
        self._place = np.full(unknowns.count, -1, np.int64)
        self._place[self._kept] = np.arange(len(self._kept))
        self._ready = False
        self._base: Any = None
        self._factors: Any = None

    @property
    def ready(self) -> bool:
        """Elements were eliminated. Equal on all ranks."""
        return self._ready

    @staticmethod
    def suits(unknowns: Unknowns, nodes: np.ndarray) -> bool:
        """Few enough of these nodes for dense matrices, and much fewer than all. Not collective."""
        kept = int((unknowns.number[np.unique(nodes)] >= 0).sum())
        return kept <= CONDENSED and 3 * kept <= unknowns.count

    def eliminate(self, elements: list[Pieces]) -> None:
        """Take the stiffness of this rank's elements. CommandError if it is singular. Collective."""
        _on_first(self.comm, elements, self._eliminate)
        self._ready = True

    def _eliminate(self, pieces: list[Pieces]) -> str | None:
        from scipy.sparse import coo_matrix
        from scipy.sparse.linalg import splu

        n, kept = self.unknowns.count, self._kept
        rows, columns, values, _, _ = self.unknowns.entries(pieces)
        matrix = coo_matrix((values, (rows, columns)), (n, n)).tocsr()
        self._gone = np.flatnonzero(self._place < 0)
        inner = matrix[self._gone][:, self._gone].tocsc()
        if not (np.isfinite(inner.data).all() and (inner.diagonal() > 0.0).all()):
            return SINGULAR
        try:
            self._inner = splu(inner, "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True})
        except RuntimeError:
            return SINGULAR
        self._in, self._out = matrix[self._gone][:, kept].tocsc(), matrix[kept][:, self._gone].tocsr()
        self._base = matrix[kept][:, kept].toarray()
        for begin in range(0, len(kept), 64):
            part = slice(begin, begin + 64)
            self._base[:, part] -= self._out @ self._inner.solve(self._in[:, part].toarray())
        return None

    def factor(self, pieces: list[Pieces]) -> None:
        """Take the pieces of this rank's joints and fluid. CommandError if the matrix is singular. Collective."""
        _on_first(self.comm, pieces, self._factor)

    def _factor(self, pieces: list[Pieces]) -> str | None:
        from scipy.linalg import lu_factor
        from scipy.sparse import coo_matrix

        rows, columns, values, _, _ = self.unknowns.entries(pieces)
        size = len(self._kept)
        matrix = self._base + coo_matrix((values, (self._place[rows], self._place[columns])), (size, size)).toarray()
        diagonal = np.abs(np.diagonal(matrix))
        if not (np.isfinite(matrix).all() and (diagonal > 0.0).all()):
            return SINGULAR
        self._scale = 1.0 / np.sqrt(diagonal)
        self._factors = lu_factor(matrix * self._scale[:, None] * self._scale, overwrite_a=True, check_finite=False)
        return None

    def solve(self, force: np.ndarray, share: float) -> np.ndarray:
        """Solve like `Direct.solve`; prescribed movements are not supported. Collective."""
        from scipy.linalg import lu_solve

        moved = None
        if self.comm.rank == 0:
            right = self.unknowns.reduced(force)
            q = np.empty(len(right))
            inner = self._inner.solve(right[self._gone])
            short = self._scale * (right[self._kept] - self._out @ inner)
            q[self._kept] = self._scale * lu_solve(self._factors, short, check_finite=False)
            q[self._gone] = inner - self._inner.solve(self._in @ q[self._kept])
            moved = self.unknowns.moved(q, share)
        return self.comm.bcast(moved)

    def close(self) -> None:
        """Do nothing: no resources outside of Python."""


class Petsc:
    """Rows shared out as nodes are owned: MUMPS if PETSc has it, else GMRES with algebraic multigrid. In space, where
    factors fill up, conjugate gradients with multigrid if the matrix is symmetric; then all components of a node have
    rows, held ones too: multigrid is made for blocks of one size. flows: as of `Direct`; then it is not symmetric."""

    flows = False

    def __init__(self, comm: Comm, unknowns: Unknowns, owner: np.ndarray, x: np.ndarray | None = None) -> None:
        """Set up the rows of each rank. owner (nn,): rank of each node; x (nn, 3) [m]: its position, in space."""
        from petsc4py import PETSc

        self.comm, self.unknowns, self._petsc, self._x = comm, unknowns, PETSc, x
        known, dim = unknowns.number >= 0, unknowns.number.shape[1]
        # PETSc wants the rows of a rank in one piece.
        if x is None:
            owners = np.empty(unknowns.count, np.int64)
            owners[unknowns.number[known]] = np.repeat(owner[:, None], dim, axis=1)[known]
            order = np.argsort(owners, kind="stable")
            self._place = np.empty(unknowns.count, np.int64)
            self._place[order] = np.arange(unknowns.count)
            self._block, self._node = 1, np.empty(0, np.int64)
        else:
            self._block, used = dim, np.flatnonzero(known.any(axis=1))
            order = np.argsort(owner[used], kind="stable")
            self._node, owners = used[order], np.repeat(owner[used], dim)
            at = np.full(len(known), -1, np.int64)
            at[self._node] = np.arange(len(used))
            self._place = np.empty(unknowns.count, np.int64)
            self._place[unknowns.number[known]] = (dim * at[:, None] + np.arange(dim))[known]
        self._rows = len(owners)
        self._held = np.ones(self._rows, bool)
        self._held[self._place] = False
        self._owner = np.empty(self._rows, np.int64)
        self._owner[:] = np.sort(owners)
        ends = np.searchsorted(self._owner, np.arange(comm.size + 1))
        self._first, self._end = int(ends[comm.rank]), int(ends[comm.rank + 1])
        self._on = PETSc.COMM_SELF if comm.mpi is None else comm.mpi
        self._matrix: Any = None
        self._ksp: Any = None
        self._coupling: Any = np.empty(0)
        self._mumps = _mumps_there(PETSc)
        self.name = "PETSc (MUMPS)" if self._mumps else "PETSc (GMRES, multigrid)"

    def factor(self, pieces: list[Pieces]) -> None:
        """Take the pieces of this rank. CommandError if the matrix is singular. Collective."""
        from scipy.sparse import coo_matrix

        self.close()
        rows, columns, values, of_rows, of_values = self.unknowns.entries([Pieces.joined([one]) for one in pieces])
        table = np.column_stack([self._place[rows].astype(float), self._place[columns].astype(float), values])
        product = np.column_stack([self._place[of_rows].astype(float), np.full(len(of_rows), -1.0), of_values])
        table = np.concatenate([table, product])
        if self.comm.size > 1:
            _, table = self.comm.to_ranks(self._owner[table[:, 0].astype(np.int64)], table)
        mine, n = self._end - self._first, self._rows
        of_given = table[:, 1] < 0.0
        self._coupling = np.bincount(table[of_given, 0].astype(np.int64) - self._first, table[of_given, 2], mine)
        table = table[~of_given]
        place = (table[:, 0].astype(np.int64) - self._first, table[:, 1].astype(np.int64))
        local = coo_matrix((table[:, 2], place), (mine, n)).tocsr()
        if self._block > 1:
            held = np.flatnonzero(self._held[self._first : self._end])
            size = np.abs(table[:, 2]).max(initial=1.0)
            local = local + coo_matrix((np.full(len(held), size), (held, self._first + held)), (mine, n)).tocsr()
        local.sort_indices()
        kind = self._petsc.IntType
        self._matrix = self._petsc.Mat().createAIJ(
            ((mine, n), (mine, n)),
            bsize=self._block,
            csr=(local.indptr.astype(kind), local.indices.astype(kind), local.data),
            comm=self._on,
        )
        self._ksp = ksp = self._petsc.KSP().create(self._on)
        ksp.setOperators(self._matrix)
        pc = ksp.getPC()
        symmetric = self._block > 1 and not (self.flows or self.comm.any(not all(map(_symmetric, pieces))))
        if symmetric:
            self.name = "PETSc (CG, multigrid)"
            ksp.setType("cg")
            ksp.setTolerances(rtol=1e-10, max_it=2000)
            self._matrix.setOption(self._petsc.Mat.Option.SYMMETRIC, True)
            self._make_multigrid(ksp)
        elif self._mumps:
            ksp.setType("preonly")
            pc.setType("lu")
            pc.setFactorSolverType("mumps")
        else:
            ksp.setType("gmres")
            ksp.setGMRESRestart(100)
            ksp.setTolerances(rtol=1e-10, max_it=2000)
            self._make_multigrid(ksp)
        try:
            ksp.setUp()
            failed = False
        except self._petsc.Error:
            failed = True
        if self.comm.any(failed):
            raise CommandError(SINGULAR)

    def _make_multigrid(self, ksp: Any) -> None:
        options, name = self._petsc.Options(), "pc_gamg_coarse_eq_limit"
        ours = not options.hasName(name)
        if ours:
            options.setValue(name, COARSEST)
        ksp.getPC().setType("gamg")
        self._matrix.setNearNullSpace(self._rigid())
        ksp.setFromOptions()  # else multigrid has no defaults
        if ours:
            options.delValue(name)

    def _rigid(self) -> Any:
        """Make the near null space: the translations, in space rotations, too. (Multigrid for elasticity needs to know
        them.)"""
        if self._x is None:
            movements = rigid_movements(np.zeros(self.unknowns.given.shape))[:, :, : self.unknowns.given.shape[1]]
        else:
            arm = self._x - self._x.mean(axis=0)
            movements = rigid_movements(arm / max(float(np.abs(arm).max(initial=0.0)), 1e-300))
        vectors: list[Any] = []
        for k in range(movements.shape[2]):
            vector = self._matrix.createVecRight()
            vector.setArray(self._spread(self.unknowns.reduced(movements[:, :, k])))
            for other in vectors:
                vector.axpy(-vector.dot(other), other)
            if vector.norm() > 0.0:
                vector.normalize()
                vectors.append(vector)
        return self._petsc.NullSpace().create(vectors=vectors, comm=self._on)

    def _spread(self, q: np.ndarray) -> np.ndarray:
        """Values of the unknowns in the rows of this rank."""
        rows = np.zeros(self._rows)
        rows[self._place] = q
        return rows[self._first : self._end]

    def solve(self, force: np.ndarray, share: float) -> np.ndarray:
        """Movements (nn, dim) [m] that undo the unbalanced forces (nn, dim), with this share of what is prescribed;
        equal on all ranks. Collective."""
        right, found = self._matrix.createVecLeft(), self._matrix.createVecRight()
        right.setArray(self._spread(self.unknowns.reduced(force)) - share * self._coupling)
        self._ksp.solve(right, found)
        failed = self._ksp.getConvergedReason() < 0
        parts = self.comm.allgather(found.getArray().copy()) if self.comm.size > 1 else [found.getArray().copy()]
        right.destroy()
        found.destroy()
        if self.comm.any(failed):
            raise CommandError(f"{self.name} found no solution (reason {self._ksp.getConvergedReason()}); {SINGULAR}")
        return self.unknowns.moved(np.concatenate(parts)[self._place], share)

    def close(self) -> None:
        """Give back what PETSc holds."""
        for held in (self._ksp, self._matrix):
            if held is not None:
                held.destroy()
        self._ksp = self._matrix = None


def _symmetric(one: Pieces) -> bool:
    """Return whether the stiffness is symmetric, except for rounding."""
    k = one.stiffness
    return bool(np.abs(k - k.transpose(0, 2, 1)).max(initial=0.0) <= 1e-12 * np.abs(k).max(initial=0.0))


def _mumps_there(petsc: Any) -> bool:
    return bool(petsc.Sys.hasExternalPackage("mumps"))


def petsc_there() -> bool:
    """petsc4py can be used on this rank. It must not take signals: the run answers them. Not collective."""
    try:
        import petsc4py

        petsc4py.init(["hpcdem", "-no_signal_handler"])
        from petsc4py import PETSc
    except (ImportError, OSError):
        return False
    return bool(np.dtype(PETSc.ScalarType) == np.float64)
