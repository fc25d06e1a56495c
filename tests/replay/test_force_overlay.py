"""Forces and captions in pictures: arrows along the projected forces, when they are drawn, and two lines of text."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from manipcli.model.state import Contact, ContactPoint
from manipcli.replay.cause import Cause
from manipcli.replay.force_overlay import FRICTION, NORMAL, scale_bar
from manipcli.replay.forces import LONGEST
from manipcli.replay.frames import Frames
from manipcli.replay.happening import happening
from manipcli.replay.playback import Phase, Playback
from tests.replay.test_frames import SIZE, run, seen_at

LARGE = (480, 360)


def pressed() -> Playback:
    """The cube is pressed upwards with 10 N at its lower face, and dragged along y with 4 N."""
    point = ContactPoint((0.0, -0.15, -0.05), (0.0, 0.0, 1.0), 10.0, (0.0, 4.0, 0.0))
    contact = Contact("cube", "table", 10.0, 0.0, (point,))
    return run(contacts=((contact,),) * 101, contact_times=((0.0,),) * 101)


def along(image: np.ndarray, colour: tuple[int, int, int], a: tuple[float, float], b: tuple[float, float]) -> float:
    """Share of the points between two pixels that have a colour nearby."""
    found = []
    for share in np.linspace(0.1, 0.8, 20):
        x, y = (round(p + share * (q - p)) for p, q in zip(a, b, strict=True))
        near = image[y - 1 : y + 2, x - 1 : x + 2].reshape(-1, 3).astype(int)
        found.append(np.abs(near - colour).max(axis=1).min() < 60)
    return float(np.mean(found))


def test_arrows_are_along_the_projected_forces() -> None:
    """10 N are the strongest force of the run, and so 0.15 m; 4 N are 0.06 m."""
    frames = Frames(pressed(), size=LARGE, captions=False, forces=True)
    bare = Frames(pressed(), size=LARGE, captions=False, forces=False)
    image, before = frames.at(0.5), bare.at(0.5)
    start = seen_at(frames.camera, (0.0, -0.15, -0.05), LARGE)
    for colour, end in (
        (NORMAL, (0.0, -0.15, -0.05 + LONGEST)),
        (FRICTION, (0.0, -0.15 + 0.4 * LONGEST, -0.05)),
    ):
        tip = seen_at(frames.camera, end, LARGE)
        assert along(image, colour, start, tip) > 0.9
        assert along(before, colour, start, tip) < 0.1


def test_a_pair_has_its_force_as_a_number_at_the_tip_of_its_arrow() -> None:
    frames = Frames(pressed(), size=LARGE, captions=False, forces=True)
    bare = Frames(pressed(), size=LARGE, captions=False, forces=False)
    x, y = (round(value) for value in seen_at(frames.camera, (0.0, -0.15, -0.05 + LONGEST), LARGE))
    beside = slice(y - 6, y + 7), slice(x + 8, x + 40)
    dark, before = (np.count_nonzero(each.at(0.5)[beside].max(axis=2) < 90) for each in (frames, bare))
    assert dark > before + 20


def test_forces_are_drawn_in_failed_steps_unless_asked_for() -> None:
    playback = pressed()
    images = {
        forces: [Frames(playback, size=SIZE, captions=False, forces=forces).at(time) for time in (0.5, 1.6)]
        for forces in (None, True, False)
    }
    assert np.array_equal(images[None][0], images[False][0])
    assert np.array_equal(images[None][1], images[True][1])
    assert not np.array_equal(images[None][1], images[False][1])


def test_the_scale_is_a_round_force_of_the_length_of_its_arrow() -> None:
    frames = Frames(pressed(), size=LARGE)
    for scale in (LONGEST / 10.0, LONGEST / 333.0, LONGEST / 0.4):
        force, length = scale_bar(frames.camera, scale, LARGE)
        assert float(f"{force:.0e}") == force and f"{force:.0e}"[0] in "125"
        assert force * scale <= LONGEST * (1.0 + 1e-9)
        right = np.array(frames.camera.X_WC.R[:, 0]) * force * scale
        x, _, _ = frames.camera.project(np.stack([frames.camera.target, frames.camera.target + right]), LARGE)
        assert length == pytest.approx(x[1] - x[0])
        assert 5.0 < length <= LARGE[0] / 6.0 + 1e-9


def test_the_second_line_is_what_happens() -> None:
    squeezed = tuple(Contact("cube", f"robot/{finger}", force, 0.0) for finger, force in (("a", 3.0), ("b", 2.5)))
    playback = run(contacts=(squeezed,) * 50 + ((),) * 51, contact_times=((0.0, 0.0),) * 50 + ((),) * 51)
    first = replace(playback.steps[0], phases=(Phase("lift", 0.0, 0.6),))
    playback = replace(
        playback, steps=(first, *playback.steps[1:]), causes=(Cause("margin missed", "by 2 mm", at=0.8),)
    )
    assert happening(playback, 0.2) == ("lift   grips 'cube' with 3 N", "plain")
    assert happening(playback, 0.7) == ("grips 'cube' with 3 N", "plain")
    assert happening(playback, 0.8) == ("margin missed: by 2 mm", "bad")
    assert happening(playback, 1.5) == ("fails at 2.00 s: it fell", "bad")
    assert happening(playback, 2.0) == ("failed: it fell", "bad")
    fine = replace(playback, steps=(first,), causes=(), verdict=replace(playback.verdict, verdict="passed", text=""))
    assert happening(fine, 2.0) == ("passed", "good")


def test_a_caption_has_two_lines() -> None:
    """Rows of text are separated by rows without any; the second line of a failed step is red."""
    playback = run()
    size = (640, 480)
    written, bare = Frames(playback, size=size), Frames(playback, size=size, captions=False)
    changed = [np.any(written.at(time) != bare.at(time), axis=2) for time in (0.5, 1.5)]
    lines = [np.count_nonzero(np.diff(np.r_[0, (one[:80].any(axis=1)).astype(int)]) == 1) for one in changed]
    assert lines == [1, 2]  # nothing happens at 0.5 s
    image = written.at(1.5)[38:70].astype(int)
    assert ((image[..., 0] > image[..., 1] + 60) & (image[..., 0] > image[..., 2] + 60)).sum() > 40
