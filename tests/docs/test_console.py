"""The runner of pages: what it accepts, what it refuses, what it writes."""

from __future__ import annotations

import importlib.util
import sys
import time
from pathlib import Path
from types import ModuleType

import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]


def load(name: str) -> ModuleType:
    """A script of `docs/scripts`, which is no package."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "docs" / "scripts" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


console = load("console")


def page_of(folder: Path, text: str, name: str = "page.md") -> Path:
    page = folder / name
    page.write_text(text, encoding="utf-8")
    return page


def differences(page: Path) -> list[str]:
    ran: list[str] = console.differences(page, console.run(page)[page])
    return ran


def test_the_shown_output_is_the_printed_one(tmp_path: Path) -> None:
    page = page_of(tmp_path, "# A page\n\n```console\n$ echo one; echo two >&2\none\ntwo\n$ true\n```\n")
    assert differences(page) == []


@pytest.mark.parametrize(
    "shown",
    [
        "one\n",
        "one\ntwo\nthree\n",
        "two\none\n",
        "one\n Two\n",
        "",
        "one\n...\ntwo\nthree\n",
        "...\none\n",
        "[exit status 1]\n",
    ],
)
def test_a_wrong_output_fails_at_its_line(tmp_path: Path, shown: str) -> None:
    page = page_of(tmp_path, f"```console\n$ true\n$ echo one; echo two\n{shown}```\n")
    (found,) = differences(page)
    assert found.startswith(f"{page}:3: $ echo one; echo two\n")


@pytest.mark.parametrize(
    ("shown", "printed", "equal"),
    [
        ("passes with 9.9 mm to spare", "passes with 10.4 mm to spare", True),
        ("passes with 9.9 mm to spare", "passes with 14.1 mm to spare", False),
        ("passes with 9.9 mm to spare", "fails with 9.9 mm to spare", False),
        ("near   9.9 mm  2 s", "near  10.1 mm  2 s", True),  # a table whose columns are wider
        ("tilted by 0.0012 deg", "tilted by 0.0021 deg", True),
        ("-0.5 m", "0.5 m", False),
        ("all 4 steps done", "all 5 steps done", False),
        ("6 of 5948 ticks", "6 of 6100 ticks", True),
        ("a step pick_1", "a step pick_2", False),
    ],
)
def test_elsewhere_numbers_that_are_measured_may_differ_by_a_share(shown: str, printed: str, equal: bool) -> None:
    assert console.matches([shown], [printed], share=console.ELSEWHERE) is equal
    assert console.matches([shown], [printed]) is False
    assert console.matches(["...", shown, "..."], ["one", printed, "two"], share=console.ELSEWHERE) is equal


@pytest.mark.parametrize(
    "shown", ["...", "one\n...", "...\nfour", "one\n...\nthree\n...", "one\n...\ntwo\nthree\nfour"]
)
def test_dots_are_any_lines(tmp_path: Path, shown: str) -> None:
    page = page_of(tmp_path, f"```console\n$ printf 'one\\ntwo\\nthree\\nfour\\n'\n{shown}\n```\n")
    assert differences(page) == []


@pytest.mark.parametrize("shown", ["oops\n", "...\n", "oops\n[exit status 2]\n"])
def test_a_failure_is_shown_with_its_exit_status(tmp_path: Path, shown: str) -> None:
    text = "```console\n$ (echo oops; exit 3)\n{}```\n"
    assert differences(page_of(tmp_path, text.format("...\n[exit status 3]\n"))) == []
    assert len(differences(page_of(tmp_path, text.format(shown)))) == 1


@pytest.mark.parametrize(
    ("one", "other", "equal"),
    [
        (
            "14.38 s simulated, 4.43 s real (4.9 x real time while simulating)",
            "14.38 s simulated, 12 s real (2 x real time while simulating)",
            True,
        ),
        ("14.38 s simulated, 4.43 s real", "14.39 s simulated, 4.43 s real", False),
        (
            "✓ passed   tasks/a.yaml::a       2.08 s  duration: 2.4 s to spare",
            "✓ passed   tasks/a.yaml::a      12.91 s  duration: 2.4 s to spare",
            True,
        ),
        (
            "✓ passed   tasks/a.yaml::a       2.08 s  duration: 2.4 s to spare",
            "✓ passed   tasks/a.yaml::a       2.08 s  duration: 2.5 s to spare",
            False,
        ),
        ("✓ 2 passed in 12.6 s, 1 process", "✓ 2 passed in 8 s, 1 process", True),
        ("✓ 2 passed in 12.6 s, 1 process", "✓ 1 passed in 12.6 s, 1 process", False),
        ("==== 2 passed in 25.52s ====", "===== 2 passed in 5.52s =====", True),
        ("==== 2 passed in 25.52s ====", "==== 1 passed in 25.52s ====", False),
    ],
)
def test_times_of_the_clock_alone_are_equal(one: str, other: str, equal: bool) -> None:
    assert console.matches([one], [other]) is equal


def test_the_shell_lasts_for_the_page(tmp_path: Path) -> None:
    page = page_of(
        tmp_path,
        "```console\n$ mkdir a && cd a\n$ x=1\n```\n\nThen:\n\n```console\n$ pwd; echo $x\n/home/you/a\n1\n```\n",
    )
    assert differences(page) == []
    assert not (Path.cwd() / "a").exists()


def test_a_backslash_goes_on_in_the_next_line(tmp_path: Path) -> None:
    page = page_of(tmp_path, "```console\n$ echo one \\\n  two\none two\n```\n")
    assert differences(page) == []


def test_a_fence_with_a_title_writes_a_file_where_the_shell_is(tmp_path: Path) -> None:
    text = "```console\n$ mkdir demo && cd demo\n```\n\n1. A file:\n\n"
    text += '   ```yaml title="tasks/mine.yaml"\n   a:\n     b: 1\n   ```\n'
    page = page_of(tmp_path, text + "\n```console\n$ cat ../demo/tasks/mine.yaml\na:\n  b: 1\n```\n")
    assert differences(page) == []


@pytest.mark.parametrize("title", ["../mine.yaml", "/tmp/mine.yaml", "a/../../mine.yaml"])
def test_a_file_outside_the_folder_is_refused(tmp_path: Path, title: str) -> None:
    page = page_of(tmp_path, f'```yaml title="{title}"\na: 1\n```\n')
    with pytest.raises(console.PageError, match="outside the folder"):
        console.run(page)


def test_a_console_fence_without_a_command_is_refused(tmp_path: Path) -> None:
    with pytest.raises(console.PageError, match="line 2: a console fence begins with"):
        console.run(page_of(tmp_path, "```console\nmanipcli run\n```\n"))


def test_a_command_that_ends_the_shell_is_refused(tmp_path: Path) -> None:
    with pytest.raises(console.PageError, match="`exit 1` ended the shell"):
        console.run(page_of(tmp_path, "```console\n$ exit 1\n```\n"))


def test_a_page_goes_on_where_another_ends(tmp_path: Path) -> None:
    first = page_of(tmp_path, "```console\n$ mkdir a && cd a && touch b\n```\n", "1.md")
    second = page_of(tmp_path, "<!-- console: after 1.md -->\n```console\n$ ls\nc\n```\n", "2.md")
    ran = console.run(second)
    assert [*ran] == [first, second]
    assert "+b" in console.differences(second, ran[second])[0]


def test_a_page_begins_with_folders_of_the_project(tmp_path: Path) -> None:
    page = page_of(tmp_path, "<!-- console: with tasks -->\n```console\n$ ls */home.yaml\ntasks/home.yaml\n```\n")
    assert differences(page) == []


def test_nothing_of_the_page_goes_on_after_it(tmp_path: Path) -> None:
    page = page_of(tmp_path, "```console\n$ sleep 600 & echo $!\n...\n```\n")
    (ran,) = console.run(page)[page]
    state = Path("/proc") / ran.printed[0] / "stat"
    for _ in range(100):  # the kernel ends it, at some time after the signal
        if not state.exists() or state.read_text().split()[2] == "Z":
            return
        time.sleep(0.05)
    pytest.fail("it still runs")


def test_write_puts_the_output_into_the_page(tmp_path: Path) -> None:
    text = "Text.\n\n  ```console\n  $ echo one; false\n  {}  $ seq 5\n  1\n  ...\n  {}\n  ```\n\nMore.\n"
    page = page_of(tmp_path, text.format("two\n", 4))
    assert console.main([str(page)]) == 1
    assert console.main(["--write", str(page)]) == 0
    assert page.read_text() == text.format("one\n  [exit status 1]\n", 5)
    assert console.main([str(page)]) == 0


@pytest.mark.parametrize(
    ("shown", "written"),
    [
        (["alpha 1", "...", "gamma 3", "...", "omega 9"], ["alpha 2", "...", "gamma 4", "...", "omega 8"]),
        (["...", "gamma 3"], ["...", "omega 8"]),
        (["alpha 1", "..."], ["alpha 2", "..."]),
        (["all"], ["alpha 2", "beta 0", "gamma 4", "delta 0", "omega 8", "[exit status 1]"]),
    ],
)
def test_write_keeps_the_dots(shown: list[str], written: list[str]) -> None:
    printed = ["alpha 2", "beta 0", "gamma 4", "delta 0", "omega 8", "[exit status 1]"]
    status = [] if written[-1].startswith("[") else ["[exit status 1]"]
    assert console.renewed(shown, printed) == [*written, *status]


def test_a_picture_that_a_command_made_is_put_beside_its_page(tmp_path: Path) -> None:
    draw = "from PIL import Image; Image.linear_gradient('L').save('a.png')"
    page = page_of(tmp_path, f'```console\n$ python -c "{draw}"\n```\n\n![A drawing](a.png)\n')
    assert console.main([str(page)]) == 0
    assert not (tmp_path / "a.png").exists()
    assert console.main(["--write", str(page)]) == 0
    with Image.open(tmp_path / "a.png") as shown:
        assert shown.size == (256, 256)
        ramp = [shown.convert("L").getpixel((128, y)) for y in range(256)]
    assert max(abs(value - y) for y, value in enumerate(ramp)) <= 4  # two levels of grey share a colour, of 128


def test_a_large_picture_is_refused(tmp_path: Path) -> None:
    page = page_of(tmp_path, "```console\n$ head -c 90000 /dev/zero > a.webp\n```\n\n![A drawing](a.webp)\n")
    with pytest.raises(console.PageError, match=r"a\.webp has 90000 bytes, more than 80000"):
        console.run(page, write=[page])
    with pytest.raises(console.PageError, match=r"a\.webp has 90000 bytes, more than 80000"):
        console.run(page)
