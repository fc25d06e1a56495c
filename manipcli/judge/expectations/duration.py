"""`duration`: the run is over in time."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from manipcli.judge.expectation import Evidence, Expectation, Measured
from manipcli.record.recording import Span
from manipcli.spec.base import Model
from manipcli.spec.quantity import Time


class DurationSpec(Model):
    """The simulated time of the whole run is `below` this."""

    below: Annotated[Time, Field(gt=0)] = Field(description="Longest simulated time [s].")


def evaluate(spec: DurationSpec, evidence: Evidence, span: Span) -> Measured:
    """`below` minus the time of the last recorded state [s]."""
    end = float(span.states.time[-1])
    return Measured(margin=spec.below - end, unit="s", at=end, text=f"{end:.3f} s of {spec.below:g} s")


DURATION = Expectation(
    name="duration", spec=DurationSpec, scope="end", evaluate=evaluate, check=lambda spec, robot, scene, steps: ()
)
