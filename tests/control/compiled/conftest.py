"""Kernels compiled from the present source, and the comparison of a law in Python with its kernel."""

from __future__ import annotations

import importlib.machinery
import importlib.util
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

import numpy as np
import pytest

from manipcli.control.compiled import library
from manipcli.control.compiled.compiler import compile_kernels

Scenario = Callable[[np.random.Generator], list[Any]]
Using = Callable[[library.Kernels | None], AbstractContextManager[None]]


class Watched:
    """Kernels that remember the names of the laws that were bound."""

    def __init__(self, kernels: library.Kernels) -> None:
        self._kernels = kernels
        self.SOURCE_CRC = kernels.SOURCE_CRC
        self.bound: set[str] = set()

    def bind(self, law: str, n: int, /, *arrays: Any) -> Any:
        kernel = self._kernels.bind(law, n, *arrays)
        self.bound.add(law)
        return kernel


@contextmanager
def _using(kernels: library.Kernels | None) -> Iterator[None]:
    before = library.use(kernels)
    try:
        yield
    finally:
        library.use(before)


@pytest.fixture(scope="session")
def kernels(tmp_path_factory: pytest.TempPathFactory) -> library.Kernels:
    made = tmp_path_factory.mktemp("kernels") / "_kernels.abi3.so"
    fault = compile_kernels(library.SOURCE, made) if library.SOURCE.exists() else "no source"
    if fault:
        pytest.skip(f"the kernels cannot be compiled here: {fault}")
    loader = importlib.machinery.ExtensionFileLoader("_kernels", str(made))
    spec = importlib.util.spec_from_file_location("_kernels", made, loader=loader)
    assert spec is not None
    module: Any = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module  # type: ignore[no-any-return]


@pytest.fixture
def using() -> Using:
    """Selects kernels, None: the laws in Python, for a `with` block."""
    return _using


@pytest.fixture
def watched(kernels: library.Kernels) -> Watched:
    """Kernels that remember the laws that were bound."""
    return Watched(kernels)


@pytest.fixture
def equal_bits(kernels: library.Kernels) -> Callable[..., None]:
    """Runs a scenario with the kernels and without, for several seeds; every array that it returns must have the same
    bits, and it must have used these laws."""

    def compare(scenario: Scenario, *laws: str, seeds: int = 40) -> None:
        for seed in range(seeds):
            watched = Watched(kernels)
            with _using(watched):
                compiled = scenario(np.random.default_rng(seed))
            assert watched.bound >= set(laws), f"{watched.bound} instead of {laws}"
            with _using(None):
                plain = scenario(np.random.default_rng(seed))
            assert len(compiled) == len(plain) > 0
            for k, (one, other) in enumerate(zip(compiled, plain, strict=True)):
                a, b = np.asarray(one), np.asarray(other)
                assert a.tobytes() == b.tobytes(), f"seed {seed}, array {k}: {a} with kernels, {b} without"

    return compare
