"""Build hook: takes the pages of docs/ into a wheel, and compiles the kernels of the control tick, where there is a C
compiler and Python's headers.

`manipcli docs` prints the pages; those of codes, which `manipcli explain` prints, and pictures stay out. Without
kernels the build goes on: every law also exists in Python and gives the same results, see
`manipcli/control/compiled`.
"""

from __future__ import annotations

import runpy
import sysconfig
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FOLDER = "manipcli/control/compiled"
LIBRARY = f"{FOLDER}/_kernels.abi3.so"


class PagesAndKernels(BuildHookInterface[Any]):
    """For an editable installation and for a wheel; one wheel serves all versions of Python."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        root = Path(self.root)
        if version != "editable":  # which reads docs/ itself
            for page in sorted((root / "docs").rglob("*.md")):
                if page.parent.name != "codes" or page.name == "README.md":
                    build_data["force_include"][str(page)] = f"manipcli/{page.relative_to(root).as_posix()}"
        compile_kernels = runpy.run_path(str(root / FOLDER / "compiler.py"))["compile_kernels"]
        fault = compile_kernels(root / FOLDER / "kernels.c", root / LIBRARY)
        if fault:
            (root / LIBRARY).unlink(missing_ok=True)
            self.app.display_warning(f"the control tick is not compiled, it runs in Python: {fault}")
            return
        platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
        build_data["pure_python"] = False
        build_data["tag"] = f"cp311-abi3-{platform}"
        build_data["artifacts"].append(f"/{LIBRARY}")
