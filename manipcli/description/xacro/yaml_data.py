"""Loader of YAML data for xacro files, with the unit tags of ROS (`!degrees`)."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Final

from manipcli.core.errors import Place
from manipcli.description.bounds import bounds
from manipcli.description.located_xml import shown_path
from manipcli.description.xacro.values import Beyond, Clock, Refused, too_large

MAX_NUMBER: Final = 400
_PLAIN: Final = "load_yaml reads plain data: numbers, text, lists and mappings"
_NUMBERS: Final = frozenset({"tag:yaml.org,2002:int", "tag:yaml.org,2002:float"})

UNITS = {
    "!radians": 1.0,
    "!degrees": math.pi / 180.0,
    "!meters": 1.0,
    "!millimeters": 0.001,
    "!foot": 0.3048,
    "!inches": 0.0254,
}


class Mistyped(Exception):
    """A data file is not valid YAML."""

    def __init__(self, message: str, place: Place) -> None:
        self.place = place
        super().__init__(message)


def load_yaml(path: Path, evaluate: Callable[[str], object], clock: Clock) -> object:
    """The data of a YAML file.

    Args:
        path: a regular file.
        evaluate: computes the text under a unit tag (`!degrees 2 * 45`).
        clock: of the expansion that reads it.

    Raises:
        Refused: too large, unknown tags, or a value under a unit tag that is not a number.
        Mistyped: not valid YAML.
    """
    import yaml

    class Loader(yaml.SafeLoader):
        """A private class: the constructors added here do not affect other uses of safe_load."""

        merged = 0

        def fetch_more_tokens(self) -> None:
            clock.look()
            super().fetch_more_tokens()

        def construct_object(self, node: yaml.Node, deep: bool = False) -> object:
            clock.look()
            if isinstance(node, yaml.ScalarNode) and node.tag in _NUMBERS and len(node.value) > MAX_NUMBER:
                message = f"{path.name}: number with {len(node.value)} characters; at most {MAX_NUMBER} are allowed"
                raise Refused(message, hint=_PLAIN)
            return super().construct_object(node, deep)

        def flatten_mapping(self, node: yaml.MappingNode) -> None:
            for key, value in node.value:
                if key.tag == "tag:yaml.org,2002:merge":
                    for merged in value.value if isinstance(value, yaml.SequenceNode) else [value]:
                        self.count(merged)
            super().flatten_mapping(node)

        def count(self, merged: yaml.Node) -> None:
            # Nested merge keys can grow tenfold with each line.
            if isinstance(merged, yaml.MappingNode):
                clock.look()
                self.flatten_mapping(merged)
                self.merged += len(merged.value)
                if self.merged > bounds().value_size:
                    raise too_large(f"{path.name}: the merge (<<)")

    def construct(factor: float) -> Callable[[Loader, yaml.ScalarNode], float]:
        def constructor(loader: Loader, node: yaml.ScalarNode) -> float:
            text, mark = str(loader.construct_scalar(node)), node.start_mark
            try:
                value = evaluate(text)
            except (ValueError, ArithmeticError) as error:
                place = Place(shown_path(path), mark.line + 1, mark.column + 1)
                raise Mistyped(f"cannot evaluate '{text}': {error}", place) from error
            if not isinstance(value, int | float):
                raise Refused(f"{path.name}: '{value}' is not a number")
            return float(value) * factor

        return constructor

    for tag, factor in UNITS.items():
        Loader.add_constructor(tag, construct(factor))
    most = bounds().yaml_bytes
    with path.open("rb") as stream:
        data = stream.read(most + 1)
    if len(data) > most:
        raise Beyond(f"{path.name} is larger than {most} bytes", "yaml_bytes")
    try:
        return yaml.load(data, Loader=Loader)
    except yaml.constructor.ConstructorError as error:
        raise Refused(f"{path.name}: {error}", hint=_PLAIN) from error
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        message = ", ".join(part for part in (error.context, error.problem) if part)
        place = Place(shown_path(path), mark.line + 1, mark.column + 1) if mark else Place(shown_path(path), 1, 1)
        raise Mistyped(f"not valid YAML: {message}", place) from error
    except (yaml.YAMLError, UnicodeDecodeError, ValueError) as error:
        raise Mistyped(f"not valid YAML: {error}", Place(shown_path(path), 1, 1)) from error
    except RecursionError as error:
        raise Refused(f"{path.name}: nested too deeply", hint=_PLAIN) from error
