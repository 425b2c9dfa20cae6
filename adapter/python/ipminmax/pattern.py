"""The places where a matrix that depends on x and y may be nonzero."""

import types
from typing import Any, Callable, Iterable, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from .differences import Box, Vector
from .problem import to_floats

Matrix = Callable[[Vector], Any]


def is_sparse(matrix: Any) -> bool:
    return hasattr(matrix, "tocoo")


def joined(parts: Iterable[Any], names: Iterable[str], columns: Sequence[int], rows: int) -> Any:
    """The matrix of blocks of so many rows and columns side by side, sparse if one is; None: zero."""
    blocks = []
    for part, name, width in zip(parts, names, columns):
        if part is not None and not is_sparse(part):
            part = to_floats(part, name)
            if part.size == rows * width and (part.ndim < 2 or rows < 2 or width == 0):
                part = part.reshape(rows, width)
        if part is not None and tuple(part.shape) != (rows, width):
            raise ValueError(f"{name} has shape {part.shape}, expected {(rows, width)}")
        blocks.append(part)
    zeros, stack = np.zeros, np.hstack  # type: Any, Any
    if any(map(is_sparse, blocks)):
        import scipy.sparse
        zeros, stack = scipy.sparse.csr_matrix, lambda all_of: scipy.sparse.hstack(all_of).tocsr()
    return stack([zeros((rows, width)) if part is None else part for part, width in zip(blocks, columns)])


class Pattern:
    """Values of an array or scipy.sparse matrix in the order of a pattern: the places that a sparse matrix stores, or
    where an array is nonzero at the start or a few points around it. A later nonzero elsewhere is an error."""

    def __init__(self, function: Matrix, v0: Vector, box: Box, shape: Tuple[int, int], name: str) -> None:
        self.shape, self.name = shape, name
        first = function(v0)
        self.is_sparse = is_sparse(first)
        self._keys = np.unique(self._stored(first)[0])
        random = np.random.default_rng(1)
        for _ in range(3):
            try:
                found = function(box.moved(v0, random, 1e-3))
            except Exception:  # undefined there
                continue
            self._keys = np.union1d(self._keys, self._stored(found)[0])
        self.rows, self.cols = np.divmod(self._keys, max(shape[1], 1))

    def _stored(self, matrix: Any) -> Tuple[npt.NDArray[np.int64], Vector]:
        """Places row * columns + column and what stands there."""
        if is_sparse(matrix) != self.is_sparse:
            raise TypeError(f"{self.name} must be either always or never sparse")
        if not self.is_sparse:
            values = to_floats(matrix, f"what {self.name} returned")
            if values.size != self.shape[0] * self.shape[1] or values.ndim > 1 and (values.shape != self.shape):
                raise ValueError(f"{self.name} has shape {values.shape}, expected {self.shape}")
            places = np.flatnonzero(values)  # NaN is nonzero
            return places, values.ravel()[places]
        if tuple(matrix.shape) != self.shape:
            raise ValueError(f"{self.name} has shape {matrix.shape}, expected {self.shape}")
        coo = matrix.tocoo()
        return coo.row.astype(np.int64) * self.shape[1] + coo.col, np.asarray(coo.data, dtype=float)

    def values(self, matrix: Any) -> Vector:
        keys, data = self._stored(matrix)
        if keys.size == self._keys.size and np.array_equal(keys, self._keys):
            return data
        places = np.searchsorted(self._keys, keys)
        found = np.isin(keys, self._keys)
        if np.any(np.isnan(data[~found])):  # undefined there: so is every entry
            return np.full(self._keys.size, np.nan)
        if not np.all(found):
            row, col = divmod(int(keys[np.argmin(found)]), self.shape[1])
            how = ("its matrices around the starting point did not store: store all entries, those "
                   "that are zero at first, too" if self.is_sparse else
                   "was zero at all points around the starting point: return a scipy.sparse matrix "
                   "that stores all entries")
            raise ValueError(f"{self.name} has an entry at ({row}, {col}) that {how}")
        return np.bincount(places, weights=data, minlength=self._keys.size).astype(float)


def entries(matrix: Any) -> Any:
    """Has the rows, cols and data of a constant matrix."""
    if is_sparse(matrix):
        found = matrix.tocsr().copy()
        found.sum_duplicates()
        found = found.tocoo()
        return types.SimpleNamespace(rows=found.row, cols=found.col, data=np.asarray(found.data, dtype=float))
    rows, cols = np.nonzero(matrix)
    return types.SimpleNamespace(rows=rows, cols=cols, data=matrix[rows, cols])


def lower_triangle(pattern: Pattern) -> npt.NDArray[np.bool_]:
    """Selects the entries of a Hessian's pattern that are read: the lower triangle."""
    n = pattern.shape[1]
    upper = pattern.cols > pattern.rows
    mirrored = np.isin(pattern.cols[upper] * n + pattern.rows[upper], pattern.rows[~upper] * n + pattern.cols[~upper])
    if not np.all(mirrored):
        at = np.flatnonzero(upper)[np.argmin(mirrored)]
        i, j = int(pattern.rows[at]), int(pattern.cols[at])
        raise ValueError(f"{pattern.name} is not symmetric: it has an entry at ({i}, {j}) and none at ({j}, {i})")
    return ~upper
