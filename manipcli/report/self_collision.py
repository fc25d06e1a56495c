"""The self-collision matrix of a robot as text and as JSON."""

from __future__ import annotations

from typing import Final

from manipcli.core.text import number_of
from manipcli.model.self_collision import CONFIDENCE, LinkPair, SelfCollisionMatrix
from manipcli.report.json import Json, dumps
from manipcli.report.table import table

_ORDER: Final = ("sometimes", "default", "always", "ignored", "never", "adjacent")


def render_text(robot: str, matrix: SelfCollisionMatrix) -> str:
    """One row per pair that can overlap, then the numbers of all kinds; pairs that never overlap are only counted."""
    shown = [pair for kind in _ORDER[:4] for pair in _of(matrix, kind)]
    shown.sort(key=lambda pair: (_ORDER.index(pair.kind), -(pair.share or 0.0), pair.a, pair.b))
    rows = [(p.a, p.b, p.kind, _percent(p), "yes" if p.checked else "no") for p in shown]
    never = _of(matrix, "never")
    proven = sum(pair.proven for pair in never)
    lines = [f"self-collision of robot '{robot}': {number_of(len(matrix.pairs), 'pair')} of links", ""]
    if rows:
        lines += [table(("link", "link", "overlap", "samples", "checked"), rows, right=("samples",)), ""]
    else:
        lines += ["no two links overlap in any sample", ""]
    lines.append(f"never: {number_of(len(never), 'pair')}, checked; {proven} of them proven for all joint values")
    if proven < len(never):
        lines.append(
            f"the others overlap in less than {100.0 * matrix.rarest:.2g} % of the configurations "
            f"({100.0 * CONFIDENCE:.0f} % confidence, {number_of(matrix.samples, 'sample')})"
        )
    lines.append(f"adjacent: {number_of(len(_of(matrix, 'adjacent')), 'pair')}, not checked")
    return "\n".join(lines)


def render_json(robot: str, matrix: SelfCollisionMatrix) -> str:
    """The whole matrix as one JSON object; `share` is null for pairs that are not sampled."""
    return dumps(
        {
            "robot": robot,
            "samples": matrix.samples,
            "confidence": CONFIDENCE,
            "never_below": round(matrix.rarest, 9),
            "pairs": [_pair(pair) for pair in matrix.pairs],
        }
    )


def _pair(pair: LinkPair) -> Json:
    return {
        "links": [pair.a, pair.b],
        "overlap": pair.kind,
        "share": pair.share,
        "proven": pair.proven,
        "checked": pair.checked,
    }


def _of(matrix: SelfCollisionMatrix, kind: str) -> list[LinkPair]:
    return [pair for pair in matrix.pairs if pair.kind == kind]


def _percent(pair: LinkPair) -> str:
    return "-" if pair.share is None else f"{100.0 * pair.share:.2f} %"
