"""All that runs on PyBullet: the reference plant and the reference camera."""

import contextlib
import os
from collections.abc import Iterator


@contextlib.contextmanager
def _standard_error_closed() -> Iterator[None]:
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)


# PyBullet's extension module announces its build time on standard error, where people look for what went wrong
with _standard_error_closed():
    import pybullet  # noqa: F401
