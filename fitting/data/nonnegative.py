"""Linear least squares with values >= 0."""

import numpy as np
import scipy

MOST = 50  # iterations of the method of Lawson and Hanson, times the number of columns


def nonnegative(A: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return x (k,) >= 0 of least |A x - y|, A (n, k).

    The method of C. L. Lawson and R. J. Hanson (Solving Least Squares Problems, 1974) may cycle where columns are nearly
    alike; the method of R. J. Stark and P. L. Parker (bounded variables, Comput. Stat. 10 (1995) 129), which starts from the
    solution without bounds, then takes its place.
    """
    try:
        return np.asarray(scipy.optimize.nnls(A, y, maxiter=MOST * A.shape[1])[0])
    except RuntimeError:
        most = MOST * A.shape[1]
        found = scipy.optimize.lsq_linear(A, y, bounds=(0.0, np.inf), method="bvls", tol=1e-14, max_iter=most)
        return np.maximum(found.x, 0.0)
