"""A process that plans points of a map, one after the other, as its parent asks for them."""

from __future__ import annotations

import faulthandler
import os
from contextlib import suppress
from multiprocessing.connection import Connection

from manipcli.core import collector
from manipcli.run.libraries import load_common
from manipcli.sweep.reach.point import plan_point
from manipcli.sweep.reach.question import PointResult, Question
from manipcli.sweep.reach.workers import Asked


def main(descriptor: int) -> None:
    """Answers on the socket with this descriptor until the parent closes it."""
    collector.spare()
    faulthandler.enable()
    parent: Connection[PointResult, Asked] = Connection(descriptor)
    os.set_inheritable(descriptor, False)
    with suppress(EOFError, OSError):  # the parent has ended
        question = parent.recv()
        assert isinstance(question, Question)
        load_common()
        while True:
            asked = parent.recv()
            assert isinstance(asked, tuple)
            parent.send(plan_point(question, *asked))
