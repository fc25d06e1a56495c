"""Measured sections of the run page: grasps, tracking and limits, energy and power."""

from __future__ import annotations

import numpy as np

from manipcli.core.geometry import Array
from manipcli.core.units import readable
from manipcli.judge.measures.facts import JointFacts, RunFacts, Use
from manipcli.judge.measures.grasp_intervals import GraspFacts, Slip, Spread
from manipcli.report.display_quantity import quantity
from manipcli.report.html.markup import Markup, element, joined
from manipcli.report.html.page_parts import heading, meter, number, of_limit, percent, seek, table

AT_LIMIT = 1e-6
"""[rad, m] A joint within this distance of its limit is shown as at the limit."""


def grasps(facts: RunFacts) -> Markup | None:
    """Contact force and slip of each grasp."""
    if not facts.holds:
        return None
    rows = []
    for hold in facts.holds:
        interval = hold.hold
        how = interval.ended if interval.lifted is not None else f"never lifted, {interval.ended}"
        links = f"{_few(hold.touching)} in contact: {', '.join(hold.links)}" if hold.links else "no contact"
        rows.append(
            (
                joined(
                    element("b", interval.body),
                    element("small", f"{interval.grasped:.2f} to {interval.until:.2f} s: {how}"),
                ),
                _forces(hold),
                element("small", links),
                _slip(hold.slip, "m"),
                _slip(hold.rotation, "rad"),
                seek(interval.grasped),
            )
        )
    about = (
        "A grasp lasts from the end of the closing motion until the object is set down or loses contact. Force: sum of "
        "the normal forces of the robot's links. Slip: how far the centre of the object moved in the tool frame."
    )
    return element(
        "section",
        heading("grasps", "Grasps", about),
        table(("object", "contact force", "links", "slip", "rotation", "from"), rows, stacks=True),
    )


def _few(touching: Spread) -> str:
    least, most = round(touching.least), round(touching.most)
    return f"{least}" if least == most else f"{least} to {most}, on average {touching.mean:.1f},"


def _forces(hold: GraspFacts) -> Markup:
    force = hold.force
    about = f"{number(force.least, 'N')} to {number(force.most, 'N')}"
    return joined(element("b", number(force.mean, "N")), element("small", f"on average; {about}"))


def _slip(slip: Slip | None, unit: str) -> Markup:
    if slip is None:
        return joined("–")
    last = f"at {slip.at:.2f} s; {quantity(slip.last, unit)} at the end"
    return joined(element("b", quantity(slip.most, unit)), element("small", last))


def joints(facts: RunFacts) -> Markup | None:
    """Tracking and limits of each joint."""
    if not facts.joints:
        return None
    saturated = any(joint.saturated for joint in facts.joints)
    rows = []
    for k, joint in enumerate(facts.joints):
        row = [
            element("b", joint.name),
            _error(joint),
            "–" if joint.error_rms is None else quantity(joint.error_rms, joint.unit),
            _sparkline(facts, facts.errors[:, k], joint),
            _position(joint),
            _use(joint.velocity, f"{joint.unit}/s"),
            _use(joint.effort, "N" if joint.unit == "m" else "N m"),
        ]
        rows.append((*row, _ticks(joint.saturated, facts.period) if saturated else None))
    headers = ["joint", "largest error", "RMS", "error over time", "position", "velocity", "effort"]
    shown = [tuple(cell or "" for cell in row[: len(headers) + saturated]) for row in rows]
    saturated_actuators = ", ".join(f"{name} {_ticks(count, facts.period)}" for name, count in facts.actuators)
    about = (
        "Error: distance from the reference of the controller; each curve has its own scale. Limits: the largest share "
        "of each limit that was used; for a position, of the distance from the middle of its range to the limit."
    )
    return element(
        "section",
        heading("joints", "Tracking and limits", about),
        table([*headers, *(["saturated at limits"] if saturated else [])], shown, numbers=("RMS",), stacks=True),
        element("p", f"Saturated actuators: {saturated_actuators}.", class_="about") if saturated_actuators else None,
    )


def _ticks(count: int, period: float) -> str:
    return f"{count} ticks ({number(count * period, 's')})" if count else "–"


def _error(joint: JointFacts) -> Markup:
    if joint.error is None:
        return joined(element("small", "no reference"))
    return element("span", element("b", quantity(joint.error.value, joint.unit)), seek(joint.error.at), class_="at")


def _position(joint: JointFacts) -> Markup:
    use = joint.position
    if use is None:
        return joined(element("small", "no limit"))
    away = abs(use.limit - use.value)
    where = "beyond" if use.share > 1.0 else "from"
    text = f"{quantity(away, joint.unit)} {where}" if away > AT_LIMIT else "at"
    return _meter(use, f"{text} {readable(use.limit, joint.unit)}".replace("-", "−"))


def _use(use: Use | None, unit: str) -> Markup:
    return joined(element("small", "no limit")) if use is None else _meter(use, of_limit(use.value, use.limit, unit))


def _meter(use: Use, text: str) -> Markup:
    return element(
        "span",
        element("span", percent(use.share), class_="share"),
        meter(use.share, label=f"{text} at {use.at:.2f} s", mark=False),
        element("small", text),
        class_="seeks use",
        data_seek=f"{use.at:.6f}",
    )


def _sparkline(facts: RunFacts, errors: Array, joint: JointFacts) -> Markup:
    """|error| over the run as a filled curve, with a line at the start of each step."""
    known = np.nan_to_num(errors)
    top = float(known.max())
    if joint.error is None or top <= 0.0:
        return joined(element("small", "none" if joint.error is not None else ""))
    high = 24.0 - 22.0 * known / top
    count = len(known)
    points = " ".join(f"{240.0 * (k + 0.5) / count:.1f},{y:.1f}" for k, y in enumerate(high.tolist()))
    length = max(facts.end - facts.start, 1e-9)
    begins = [240.0 * (step.started - facts.start) / length for step in facts.steps[1:]]
    label = f"tracking error of {joint.name}: at most {quantity(joint.error.value, joint.unit)}"
    drawn = (
        *(element("line", x1=x, x2=x, y1="0", y2="24") for x in begins),
        element("polygon", points=f"0,24 {points} 240,24"),
    )
    svg = element(
        "svg", *drawn, class_="spark", viewBox="0 0 240 24", preserveAspectRatio="none", role="img", aria_label=label
    )
    return element("span", svg, class_="seeks", data_seek=f"{joint.error.at:.6f}", title=label)


def energy(facts: RunFacts) -> Markup | None:
    """Work and power, by joint and by step."""
    if not facts.steps:
        return None
    columns = [step.id for step in facts.steps]
    given, taken = (sum(getattr(one, key) for one in facts.joints) for key in ("given", "taken"))
    peak = max(step.total.value for step in facts.steps)
    sums = [
        _work(given, taken, peak),
        *(_work(float(one.given.sum()), float(one.taken.sum()), one.total.value) for one in facts.steps),
    ]
    rows = []
    for k, joint in enumerate(facts.joints):
        cells = [_work(float(one.given[k]), float(one.taken[k]), float(one.power[k])) for one in facts.steps]
        rows.append((element("b", joint.name), _work(joint.given, joint.taken, joint.power.value), *cells))
    headers = ("", "whole run", *columns)
    about = (
        "Mechanical energy that the joints delivered: the integral of effort times velocity where it is positive; the "
        "energy that they absorbed; and the peak power, for all joints the peak of their sum."
    )
    return element(
        "section",
        heading("energy", "Energy and power", about),
        table(headers, [(element("b", "all joints"), *sums)], numbers=headers[1:]),
        element("details", element("summary", "each joint"), table(headers, rows, numbers=headers[1:])),
    )


def _work(given: float, taken: float, power: float) -> Markup:
    return joined(
        number(given, "J"), element("small", f"{number(taken, 'J')} absorbed"), element("small", number(power, "W"))
    )
