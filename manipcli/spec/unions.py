"""Discriminated unions of steps, conditions, controllers and sensors, built from the registered members.

A step is a mapping with exactly one verb key and the common keys `id`, `until`, `timeout` and `on_fail`; a condition is
a mapping with its name as the only key; an expectation is a condition, or `always`, `never`, `eventually` with a
condition, and the common keys `id`, `at`, `during` and `within`; a watch is `always` or `never`. The key `type` of a
controller or sensor names the member.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, reduce
from operator import or_
from types import MappingProxyType
from typing import Annotated, ForwardRef, Optional, Protocol, TypeVar, cast

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, create_model
from typing_extensions import TypeAliasType

from manipcli.core.registry import Seam
from manipcli.core.text import did_you_mean, escape, listed
from manipcli.spec.base import Model, about, problem
from manipcli.spec.block import BlockSpec
from manipcli.spec.condition import (
    COMBINATIONS,
    QUANTIFIERS,
    SELECTING,
    SINGLE,
    WATCHED,
    ConditionSpec,
    ExpectationSpec,
    KeyedSpec,
    SelectedSpec,
    WatchSpec,
)
from manipcli.spec.controllers import ControllerSpec
from manipcli.spec.controllers_file import ControllersSpec
from manipcli.spec.robot import RobotSpec
from manipcli.spec.sensors import SensorName
from manipcli.spec.simulation import SimulationSpec
from manipcli.spec.spread import spread, written_as
from manipcli.spec.step import StepSpec
from manipcli.spec.structure.words import WORDS, other_word
from manipcli.spec.task import TaskSpec


class SpecMember(Protocol):
    """A step, condition, engine or path planner as the specs need it: its key or `type` in YAML, and the spec of its
    block."""

    @property
    def name(self) -> str: ...

    @property
    def spec(self) -> type[Model]: ...


class ControllerSpecMember(Protocol):
    """A controller as the union needs it: its `type` in YAML, and the spec of the whole block."""

    @property
    def name(self) -> str: ...

    @property
    def spec(self) -> type[ControllerSpec]: ...


S = TypeVar("S", bound=SpecMember)
C = TypeVar("C", bound=SpecMember)
E = TypeVar("E", bound=SpecMember)
P = TypeVar("P", bound=SpecMember)
L = TypeVar("L", bound=ControllerSpecMember)
N = TypeVar("N", bound=SpecMember)

_STEP = tuple(name for name in StepSpec.model_fields if name != "verb")
_EXPECTATION = tuple(ExpectationSpec.model_fields)


def task_model(
    steps: Seam[S], conditions: Seam[C], engines: Seam[E], planners: Seam[P], sensors: Seam[N]
) -> type[TaskSpec]:
    """`TaskSpec` with the steps, conditions, engines, path planners and sensors of the seams; the same class for the
    same members."""
    return _task_model(_members(steps), _members(conditions), _members(engines), _members(planners), _members(sensors))


Members = tuple[tuple[str, type[Model]], ...]


def _members(seam: Seam[S]) -> Members:
    return tuple((member.name, member.spec) for member in seam)


@lru_cache(maxsize=8)
def _task_model(
    steps: Members, conditions: Members, engines: Members, planners: Members, sensors: Members
) -> type[TaskSpec]:
    condition = _conditions(conditions)
    expectation = _expectations(conditions, condition)
    until = (Optional[condition], StepSpec.model_fields["until"])  # noqa: UP045  (`object` has no operator `|`)
    asked = {name: (Optional[condition], BlockSpec.model_fields[name]) for name in ("condition", "until")}  # noqa: UP045
    block = create_model("BlockSpec", __base__=BlockSpec, __doc__=BlockSpec.__doc__, **asked)  # type: ignore[call-overload]
    steps_of = [_wrapped(StepSpec, name, spec, {"until": until}) for name, spec in steps]
    step = _union("verb", steps_of, common=_STEP)
    simulation = simulation_model(engines)
    planner = _planners(planners)
    # These types exist only at run time; type checkers cannot follow them.
    model = create_model(
        "TaskSpec",
        __base__=TaskSpec,
        __doc__=TaskSpec.__doc__,
        simulation=(simulation, Field(simulation(), description=TaskSpec.model_fields["simulation"].description)),
        planner=(
            planner,
            Field(  # type: ignore[arg-type]
                planners[0][1](), description=TaskSpec.model_fields["planner"].description
            ),
        ),
        sensors=(_sensors(sensors), TaskSpec.model_fields["sensors"]),  # type: ignore[arg-type]
        steps=(tuple[step, ...], TaskSpec.model_fields["steps"]),  # type: ignore[valid-type]
        blocks=(tuple[block, ...], TaskSpec.model_fields["blocks"]),
        expect=(tuple[expectation, ...], TaskSpec.model_fields["expect"]),  # type: ignore[valid-type]
        watch=(tuple[_watches([name for name, _ in conditions], condition), ...], TaskSpec.model_fields["watch"]),  # type: ignore[arg-type, misc]
    )
    model.verbs = tuple(name for name, _ in steps)
    return cast(type[TaskSpec], model)


def simulation_model(engines: Members) -> type[SimulationSpec]:
    """`SimulationSpec` with a block for each engine with settings."""
    own = {name: (spec, Field(spec(), description=about(spec))) for name, spec in engines if spec.model_fields}
    default = SimulationSpec.model_fields["engine"].default
    text = f"Engine: {', '.join(f'`{name}`' for name, _ in engines)}. Default {default}."
    names = [name for name, _ in engines]

    def known(engine: str) -> str:
        if engine not in names:
            near = did_you_mean(engine, names, kind="engines")
            raise problem("name", f"unknown engine '{escape(engine)}'", hint=near)
        return engine

    # The field names are only known at run time: no overload of create_model fits.
    made = create_model(  # type: ignore[call-overload]
        "SimulationSpec",
        __base__=SimulationSpec,
        __doc__=SimulationSpec.__doc__,
        engine=(Annotated[str, AfterValidator(known)], Field(default, description=text)),
        **own,
    )
    return cast(type[SimulationSpec], made)


def _planners(members: Members) -> object:
    """Union of the path planners by their `type`, the first by default."""
    any_of = _by_type([spec for _, spec in members])
    default = members[0][0]

    def typed(value: object) -> object:
        return {"type": default, **value} if isinstance(value, dict) and "type" not in value else value

    return Annotated[any_of, BeforeValidator(typed)]


def controllers_model(controllers: Seam[L]) -> type[ControllersSpec]:
    """`ControllersSpec` with the types of the members; the same class for the same members."""
    return _controllers_model(tuple((member.name, member.spec) for member in controllers))


@lru_cache(maxsize=8)
def _controllers_model(members: tuple[tuple[str, type[ControllerSpec]], ...]) -> type[ControllersSpec]:
    any_of = _by_type([spec for _, spec in members])
    # This type exists only at run time; type checkers cannot follow it.
    model = create_model(
        "ControllersSpec",
        __base__=ControllersSpec,
        __doc__=ControllersSpec.__doc__,
        controllers=(dict[str, any_of], ControllersSpec.model_fields["controllers"]),  # type: ignore[valid-type]
    )
    model.types = MappingProxyType(dict(members))
    return cast(type[ControllersSpec], model)


def robot_model(sensors: Seam[N]) -> type[RobotSpec]:
    """`RobotSpec` with the sensors of the members; the same class for the same members."""
    return _robot_model(_members(sensors))


@lru_cache(maxsize=8)
def _robot_model(members: Members) -> type[RobotSpec]:
    field = (_sensors(members), RobotSpec.model_fields["sensors"])
    return cast(
        type[RobotSpec],
        create_model("RobotSpec", __base__=RobotSpec, __doc__=RobotSpec.__doc__, sensors=field),  # type: ignore[arg-type]
    )


def _sensors(members: Members) -> object:
    """Sensors by name, each of any type."""
    any_of = _by_type([spec for _, spec in members])
    return Optional[dict[SensorName, any_of]]  # type: ignore[valid-type]  # noqa: UP045  (a type only at run time)


def _by_type(specs: Sequence[type[Model]]) -> object:
    """Union of specs by their key `type`."""
    any_of: object = reduce(or_, specs[1:], specs[0])
    return Annotated[any_of, Field(discriminator="type")] if len(specs) > 1 else any_of


def _conditions(members: Members) -> object:
    """Union of all conditions, and of `all`, `any`, `not` over conditions, recursively."""
    own = ForwardRef(_CONDITION)
    leaves = [_wrapped(ConditionSpec, name, spec, {}) for name, spec in members]
    combined = [_combined(ConditionSpec, name, own) for name in COMBINATIONS if name not in SELECTING]
    selected = [_combined(SelectedSpec, name, own) for name in COMBINATIONS if name not in SELECTING]
    over = _over_selections(ConditionSpec, members, selected)
    condition = _union("condition", [*leaves, *combined, *over], common=())
    alias = TypeAliasType(_CONDITION, condition)  # type: ignore[misc]  # a named type, which can refer to itself
    for model in (*selected, *combined, *over):
        model.model_rebuild(_types_namespace={_CONDITION: alias})
    return alias


def _over_selections(
    base: type[KeyedSpec], members: Members, combined: Sequence[type[KeyedSpec]]
) -> list[type[KeyedSpec]]:
    """`base` with each of the fields `all_of`, `any_of`, `at_least`: a condition with its selection."""
    models = [*(_wrapped(SelectedSpec, name, spec, {}, selected=True) for name, spec in members), *combined]
    one_of = _union("condition", models, common=tuple(SelectedSpec.model_fields))
    specs = dict(members)
    return [
        _keyed(base, word, Annotated[one_of, BeforeValidator(spread(word, specs))], COMBINATIONS[word])
        for word in SELECTING
    ]


def _expectations(members: Members, condition: object) -> object:
    """Union of conditions and combinations with their time, and of `always`, `never`, `eventually` over conditions."""
    plain = [name for name in COMBINATIONS if name not in SELECTING]
    models = [_wrapped(ExpectationSpec, name, spec, {}) for name, spec in members]
    models += [_combined(ExpectationSpec, name, condition) for name in plain]
    models += _over_selections(ExpectationSpec, members, [_combined(SelectedSpec, name, condition) for name in plain])
    models += [_keyed(ExpectationSpec, name, condition, text) for name, text in QUANTIFIERS.items()]
    return _union("expectation", models, common=_EXPECTATION)


def _watches(names: Sequence[str], condition: object) -> object:
    """Union of `never` and `always` over any condition."""
    models = [_keyed(WatchSpec, name, condition, QUANTIFIERS[name]) for name in WATCHED]
    return _union("watch", models, common=("id", "during"), below=(*names, *COMBINATIONS))


_CONDITION = "Condition"


def _combined(base: type[KeyedSpec], name: str, condition: object) -> type[KeyedSpec]:
    """`base` with the field `all`, `any` (a list of conditions), or `not`, `believed` (a condition)."""
    # `condition` is a type only at run time; type checkers cannot follow it.
    listed = Annotated[tuple[condition, ...], Field(min_length=1)]  # type: ignore[valid-type]
    return _keyed(base, name, condition if name in SINGLE else listed, COMBINATIONS[name])


def _union(kind: str, models: Sequence[type[KeyedSpec]], *, common: Sequence[str], below: Sequence[str] = ()) -> object:
    """Annotated union of models, each identified by one key; validates that exactly one such key is given.

    `below`: keys that belong inside any of the models.
    """
    names = tuple(model.word for model in models)
    tagged = [Annotated[model, Tag(_tag(model.word))] for model in models]
    one_of = reduce(or_, tagged[1:], tagged[0]) if len(tagged) > 1 else tagged[0]
    if len(tagged) > 1:
        one_of = Annotated[one_of, Discriminator(_key_of(names))]
    return Annotated[one_of, BeforeValidator(_check(kind, names, tuple(common), tuple(below)))]


def _tag(name: str) -> str:
    """Pydantic's name of a branch in locations; the brackets keep it apart from keys."""
    return f"<{name}>"


def _wrapped(
    base: type[KeyedSpec], name: str, spec: type[Model], fields: dict[str, object], *, selected: bool = False
) -> type[KeyedSpec]:
    """`base` with the single field `name`, which holds the member's spec; `selected`: its object may be left out."""
    empty = not any(field.is_required() for field in spec.model_fields.values())
    written = written_as(spec) if selected else spec | None if empty else spec
    default = BeforeValidator(_nothing_is_default, json_schema_input_type=written)
    return _keyed(base, name, Annotated[spec, default], about(spec), **fields)


def _keyed(base: type[KeyedSpec], name: str, holds: object, text: str, **fields: object) -> type[KeyedSpec]:
    """`base` with the single field `name` of any type."""
    # The field names are only known at run time: no overload of create_model fits.
    made = create_model(  # type: ignore[call-overload]
        "".join(word.capitalize() for word in name.split("_")) + base.__name__.removesuffix("Spec"),
        __base__=base,
        __doc__=text,
        **fields,
        **{name: (holds, Field(description=text))},
    )
    keyed = cast(type[KeyedSpec], made)
    keyed.word = name
    return keyed


def _nothing_is_default(body: object) -> object:
    """`- release:` without a value means all defaults."""
    return {} if body is None else body


def _key_of(names: tuple[str, ...]) -> Callable[[object], str | None]:
    def key_of(value: object) -> str | None:
        if isinstance(value, dict):
            return next((_tag(name) for name in names if name in value), None)
        return _tag(str(getattr(value, "word", "")))

    return key_of


def _check(
    kind: str, names: tuple[str, ...], common: tuple[str, ...], below: tuple[str, ...]
) -> Callable[[object], object]:
    """Validator: exactly one of `names` among the keys. The member's model checks the rest."""

    kinds = f"{kind}es" if kind.endswith("ch") else f"{kind}s"
    what, its = ("a step", "verb") if kind == "verb" else (f"an {kind}" if kind[0] in "aeiou" else f"a {kind}", "name")

    def check(value: object) -> object:
        if isinstance(value, Model):
            return value
        if not isinstance(value, dict):
            without_colon = isinstance(value, str) and value in names
            hint = f"write `{value}:` with a colon" if without_colon else f"{kinds}: {listed(names)}"
            raise problem("verb", f"expected {what}: a mapping with one {its}", hint=hint)
        found = [key for key in value if key in names]
        others = [str(key) for key in value if key not in names and key not in common]
        if len(found) > 1:
            message = f"{what} has exactly one {its}, not both '{found[0]}' and '{found[1]}'"
            raise problem("verb", message, at=(found[1],), key=True, hint=f"write a list item for each {kind}")
        if not found and others:
            more = WORDS if kind == "verb" else ()
            near = did_you_mean(others[0], (*names, *more, *common), kind=kinds, most=3)
            if kind == "verb":
                near = other_word(others[0]) or near
            if others[0] in below:
                near = " or ".join(f"`{name}: {{{others[0]}: ...}}`" for name in reversed(names))
                near = f"write {near}"
            message = f"unknown {kind} '{escape(others[0])}', expected one of {listed((*names, *more), most=40)}"
            raise problem("name", message, at=(others[0],), key=True, hint=near)
        if not found:
            raise problem("verb", f"{what} needs a {its}: one of {listed(names, most=30)}")
        return value

    return check
