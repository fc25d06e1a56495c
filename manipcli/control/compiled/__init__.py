"""Compiled kernels of the control tick, and the switch between them and the laws in Python.

The laws in Python are the definition. A kernel computes one of them for all joints in one call, with the same bits; it
is an optional part of an installation: without a compiler at install time there is none, and every law runs in Python.

    run = bind("errors", n, reference, position, velocity, errors)     # None: use the law
"""

from manipcli.control.compiled.library import Run, bind, kernels_in_use

__all__ = ["Run", "bind", "kernels_in_use"]
