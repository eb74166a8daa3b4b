"""How many threads linear algebra may use. This imports nothing that imports NumPy."""

from __future__ import annotations

import os


def one_thread_for_linear_algebra() -> None:
    """Let BLAS use one thread unless the environment says otherwise; it reads this when NumPy is imported.

    The matrices are small, and waiting for another thread takes longer than the work: on two processors of which
    others use one, the online estimator's renewals took five times the processor time with two threads. The commands
    use threads themselves: with those of BLAS in addition, ``sysid gap`` took 34 s instead of 29 s.
    """
    if "OMP_NUM_THREADS" not in os.environ:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
