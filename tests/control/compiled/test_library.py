"""What `bind` accepts, and when the kernels are used."""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from manipcli.control.compiled import bind, kernels_in_use, library
from manipcli.control.compiled.compiler import compile_kernels

Using = Callable[[library.Kernels | None], AbstractContextManager[None]]


def vectors(*sizes: int) -> list[np.ndarray]:
    return [np.zeros(size) for size in sizes]


def test_without_kernels_every_law_is_that_in_python(using: Using) -> None:
    with using(None):
        assert not kernels_in_use()
        assert bind("errors", 2, *vectors(4, 2, 2, 4)) is None


def test_arrays_of_another_layout_or_type_are_left_to_the_law_in_python(kernels: library.Kernels, using: Using) -> None:
    reference, position, velocity, errors = vectors(4, 2, 2, 4)
    frozen = errors.copy()
    frozen.flags.writeable = False
    with using(kernels):
        assert bind("errors", 2, reference, position, velocity, errors) is not None
        assert bind("errors", 2, reference, np.zeros(4)[::2], velocity, errors) is None
        assert bind("errors", 2, reference, position.astype(np.float32), velocity, errors) is None
        assert bind("errors", 2, reference, np.zeros(2, dtype=np.int64), velocity, errors) is None
        assert bind("errors", 2, reference, position, velocity, frozen) is None


def test_arrays_of_another_length_are_refused(kernels: library.Kernels, using: Using) -> None:
    """A kernel never reads or writes beyond an array."""
    index = np.array([0, 3])
    none = np.zeros(0, dtype=np.int64)
    with using(kernels):
        for law, n, arrays in (
            ("errors", 2, vectors(4, 2, 3, 4)),
            ("errors", -1, vectors(4, 2, 2, 4)),
            ("copies", 3, [np.zeros(3), index, np.zeros(2)]),
            ("copies", 3, [np.zeros(4), index, np.zeros(1)]),
            ("copies", 3, [np.zeros(4), -index, np.zeros(2)]),
            ("copies", 3, [np.zeros(4), index]),
            ("model_efforts", 2, [*vectors(2, 2), none, none, np.zeros(0), index, np.zeros(2)]),
            ("rows", 0, vectors(7, 3)),
            ("unknown", 1, vectors(1)),
        ):
            with pytest.raises(ValueError, match=f"{law}|no law"):
                bind(law, n, *arrays)


def test_a_row_beyond_the_last_and_a_wrong_call_are_refused(kernels: library.Kernels, using: Using) -> None:
    rows, source = np.zeros((2, 3)), np.ones(3)
    with using(kernels):
        run = bind("rows", 0, rows, source)
    assert run is not None
    run(1)
    assert rows.tolist() == [[0, 0, 0], [1, 1, 1]]
    for beyond in (2, -1):
        with pytest.raises(IndexError):
            run(beyond)
    with pytest.raises(TypeError):
        run()
    with pytest.raises(TypeError):
        run("0")


def test_efforts_of_another_type_or_length_are_refused(kernels: library.Kernels, using: Using) -> None:
    """They are given to each run, not bound. Eight bytes of an integer are not a double: 1 would be read as 5e-324."""
    none, command = np.zeros(0, dtype=np.int64), np.zeros(2)
    with using(kernels):
        run = bind("model_efforts", 2, *vectors(2, 2), none, none, np.zeros(0), np.arange(2), command)
    assert run is not None
    for efforts in (np.ones(2, dtype=np.int64), np.ones(4, dtype=np.float32), np.ones(2, dtype=">f8")):
        with pytest.raises(TypeError, match="double"):
            run(efforts, False)
    with pytest.raises(ValueError, match="another number of joints"):
        run(np.ones(3), False)
    assert command.tolist() == [0.0, 0.0]
    run(np.array([1.0, 2.0]), False)
    assert command.tolist() == [1.0, 2.0]


def test_a_kernel_keeps_its_arrays(kernels: library.Kernels, using: Using) -> None:
    rows = np.zeros((2, 1000))
    with using(kernels):
        run = bind("rows", 0, rows, np.full(1000, 3.0))
    assert run is not None
    run(1)
    assert (rows[1] == 3.0).all()


def test_kernels_of_another_source_are_not_used(monkeypatch: pytest.MonkeyPatch, kernels: library.Kernels) -> None:
    """After an update of the repository without another installation."""
    package = "manipcli.control.compiled._kernels"
    stale = SimpleNamespace(SOURCE_CRC=kernels.SOURCE_CRC ^ 1)
    for module, used in ((kernels, True), (stale, False)):
        monkeypatch.setitem(sys.modules, package, module)
        monkeypatch.setattr("manipcli.control.compiled._kernels", module, raising=False)
        monkeypatch.setenv(library.SWITCH, "")
        assert (library._load() is module) == used
        monkeypatch.setenv(library.SWITCH, "off")
        assert library._load() is None


def test_without_a_compiler_the_reason_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("CC", "no-such-compiler -O1")
    monkeypatch.setattr("sysconfig.get_config_var", lambda name: "cc")
    source = tmp_path / "kernels.c"
    source.write_text("int nothing;")
    fault = compile_kernels(source, tmp_path / "made.so")
    assert "no-such-compiler: No such file" in fault
    assert [*tmp_path.iterdir()] == [source]


def test_the_first_error_of_a_compiler_is_named(tmp_path: Path) -> None:
    source = tmp_path / "kernels.c"
    source.write_text("#error deliberate\n")
    fault = compile_kernels(source, tmp_path / "made.so")
    assert "deliberate" in fault or "No such file" in fault
    assert [*tmp_path.iterdir()] == [source]
