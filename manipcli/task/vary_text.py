"""The entries of `vary:` in English."""

from __future__ import annotations

from manipcli.core.prose import listing, sentence
from manipcli.spec.vary import DistributionSpec, Value, VarySpec


def varied_sentence(path: str, spec: VarySpec) -> str:
    """`scene.cup.at: offset by a value between -2 cm and 2 cm.`"""
    law = _law(spec.distribution)
    if spec.offset is not None:
        return sentence(f"`{path}` is offset by {law}")
    if spec.scale is not None:
        return sentence(f"`{path}` is multiplied by {law}")
    return sentence(f"`{path}` is {law}")


def _law(law: DistributionSpec) -> str:
    if law.uniform is not None:
        return f"a value between {_amount(law.uniform[0])} and {_amount(law.uniform[1])}, all equally likely"
    if law.normal is not None:
        mean, sd = _amount(law.normal.mean), _amount(law.normal.sd)
        return f"normally distributed about {mean} with a standard deviation of {sd}"
    items = listing([_amount(item) for item in law.choice or law.grid or ()], "or")
    return f"one of {items}, {'at random' if law.choice is not None else 'in turn'}"


def _amount(value: Value) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_amount, value))}]"
    return value if isinstance(value, str) else f"{value:g}"
