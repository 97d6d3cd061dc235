"""Load Triton before anything is drawn: with Mesa's LLVM in the process it crashes as PyTorch first imports it."""

import contextlib

with contextlib.suppress(ImportError):
    import triton  # noqa: F401
