"""Structure of steps in the JSON Schema of a task: nested lists, `repeat`, `if`, `do`, `include`."""

from __future__ import annotations

from typing import Final

from manipcli.spec.condition import ID
from manipcli.spec.source.tree import Plain
from manipcli.spec.structure.rounds import MOST_ROUNDS
from manipcli.spec.structure.words import COMMON, WORDS

STEP, STEPS, CONDITION, FILES = "Step", "Steps", "BranchCondition", "IncludedFiles"
_PARAMETER: Final[Plain] = {"type": "string", "pattern": r"^\s*\$[A-Za-z_]\w*\s*$"}
_FILE: Final[Plain] = {"type": "string", "minLength": 1}


def add_structure(schema: dict[str, Plain]) -> None:
    """Adds the words of structure to the schema of a task with flat steps, in place; removes `blocks`."""
    properties, defs = _mapping(schema, "properties"), _mapping(schema, "$defs")
    properties.pop("blocks", None)
    block = _mapping(_mapping({"block": defs.pop("BlockSpec", {})}, "block"), "properties")
    steps = _mapping(properties, "steps")
    common: dict[str, Plain] = {key: block[key] for key in COMMON[1:] if key in block}
    common["id"] = {
        "type": "string",
        "pattern": rf"^{ID.pattern}$|\$",
        "description": "Begins the ids of its steps. Default: the word and a number.",
    }
    words = [_item(word, text, common) for word, text in WORDS.items()]
    defs[STEP] = steps["items"]
    items: Plain = {"anyOf": [{"$ref": f"#/$defs/{STEP}"}, *words]}
    defs[STEPS] = {"type": "array", "minItems": 1, "items": items}
    defs[CONDITION] = _condition()
    defs[FILES] = {"anyOf": [_FILE, {"type": "array", "items": _FILE, "minItems": 1}]}
    properties["steps"] = {"$ref": f"#/$defs/{STEPS}", "description": steps.get("description", "")}
    for key in ("scene", "frames"):
        named = _mapping(properties, key)
        about = f"Files whose `{key}:` is inserted here."
        included: Plain = {"anyOf": [{"$ref": f"#/$defs/{FILES}"}, named.get("additionalProperties", {})]}
        named["properties"] = {"include": {**_mapping({"": included}, ""), "description": about}}


def _item(word: str, text: str, common: dict[str, Plain]) -> Plain:
    """A list item with a word and the keys next to it."""
    listed: Plain = {"$ref": f"#/$defs/{STEPS}"}
    keys: dict[str, dict[str, Plain]] = {
        "sequence": {"sequence": listed},
        "repeat": {"repeat": _repeat()},
        "if": {"if": {"$ref": f"#/$defs/{CONDITION}"}, "then": listed, "else": listed},
        "parallel": {"parallel": {"type": "array", "items": {"$ref": f"#/$defs/{STEP}"}, "minItems": 2, "maxItems": 2}},
        "do": {"do": _FILE, "with": {"type": "object", "description": "Values of the params of the sub-task."}},
        "include": {"include": {"$ref": f"#/$defs/{FILES}"}},
    }
    own = keys[word]
    own[word] = {**_mapping(own, word), "description": text}
    required: list[Plain] = ["if", "then"] if word == "if" else [word]
    return {
        "type": "object", "description": text, "additionalProperties": False, "required": required,
        "properties": {**own, **({} if word == "include" else common)},
    }  # fmt: skip


def _repeat() -> Plain:
    counted: Plain = {
        "anyOf": [{"type": "integer", "minimum": 1, "maximum": MOST_ROUNDS}, {"type": "string", "pattern": r"\$"}]
    }
    values: Plain = {"anyOf": [{"type": "array", "minItems": 1}, _PARAMETER]}
    named: Plain = {"type": "object", "minProperties": 1, "additionalProperties": values}
    return {
        "type": "object", "additionalProperties": False, "required": ["steps"],
        "oneOf": [{"required": ["times"]}, {"required": ["each"]}],
        "properties": {
            "times": {**_mapping({"": counted}, ""), "description": "Number of rounds; `$index` counts them from 0."},
            "each": {**_mapping({"": named}, ""), "description": "Parameters with one value for each round."},
            "steps": {"$ref": f"#/$defs/{STEPS}"},
        },
    }  # fmt: skip


def _condition() -> Plain:
    inner: Plain = {"$ref": f"#/$defs/{CONDITION}"}
    several: Plain = {"type": "array", "minItems": 1, "items": inner}

    def alone(word: str, holds: Plain) -> Plain:
        return {"type": "object", "required": [word], "additionalProperties": False, "properties": {word: holds}}

    pair: Plain = {"type": "array", "minItems": 2, "maxItems": 2, "description": "Whether two values are equal."}
    own = [alone("equal", pair), alone("all", several), alone("any", several), alone("not", inner)]
    return {"anyOf": [{"$ref": "#/$defs/Condition"}, *own, {"type": "boolean"}, _PARAMETER]}


def _mapping(holder: dict[str, Plain], key: str) -> dict[str, Plain]:
    found = holder.get(key)
    assert isinstance(found, dict)
    return found
