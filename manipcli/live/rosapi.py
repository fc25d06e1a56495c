"""Services of rosapi, which clients of rosbridge ask for names and types; they only read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from manipcli.live.command import Values
from manipcli.live.offer import Offer
from manipcli.record.definition import Array, Message, Number, Text, Type
from manipcli.record.json_message import BadMessage, definition

NODE: Final = "/manipcli"


class Rosapi:
    """Answers requests; `clock`: returns the simulated time."""

    def __init__(self, offer: Offer, clock: Callable[[], dict[str, int]]) -> None:
        self._offer = offer
        self._answers: dict[str, Callable[[Mapping[str, Any]], Values]] = {
            "topics": lambda _: {"topics": [*offer.topics], "types": [*offer.topics.values()]},
            "topic_type": lambda asked: {"type": offer.topics.get(_rooted(asked, "topic"), "")},
            "topics_for_type": lambda asked: {"topics": _of_type(offer.topics, _text(asked, "type"))},
            "services": lambda _: {"services": [*offer.services, *self.names]},
            "service_type": lambda asked: {"type": self._service_types.get(_rooted(asked, "service"), "")},
            "services_for_type": lambda asked: {"services": _of_type(self._service_types, _text(asked, "type"))},
            "action_servers": lambda _: {"action_servers": [*offer.actions]},
            "action_type": lambda asked: {"type": offer.actions.get(_rooted(asked, "action"), "")},
            "nodes": lambda _: {"nodes": [NODE]},
            "node_details": self._node_details,
            "get_time": lambda _: {"time": clock()},
            "get_ros_version": lambda _: {"version": 2, "distro": "manipcli"},
            "get_param_names": lambda _: {"names": []},
            "has_param": lambda _: {"exists": False},
            "message_details": lambda asked: _details(_text(asked, "type")),
            "service_request_details": lambda asked: _details(f"{_text(asked, 'type')}_Request"),
            "service_response_details": lambda asked: _details(f"{_text(asked, 'type')}_Response"),
        }
        self.names = tuple(f"/rosapi/{name}" for name in self._answers)

    @property
    def _service_types(self) -> dict[str, str]:
        """Of all services; those of rosapi have the names of its package."""
        own = {name: f"rosapi_msgs/srv/{''.join(map(str.title, name[8:].split('_')))}" for name in self.names}
        return {**self._offer.services, **own}

    def call(self, name: str, request: object) -> Values:
        """The response of a service.

        Raises:
            BadMessage: an unknown service, or a request without what it needs.
        """
        answer = self._answers.get(name.removeprefix("/rosapi/"))
        if answer is None:
            raise BadMessage(f"unknown service '{name[:80]}'")
        if request == []:
            request = {}
        if not isinstance(request, dict):
            raise BadMessage("the request must be an object")
        return answer(request)

    def _node_details(self, asked: Mapping[str, Any]) -> Values:
        if _rooted(asked, "node") != NODE:
            raise BadMessage(f"unknown node; the only one is {NODE}")
        offer = self._offer
        return {
            "subscribing": [*offer.received],
            "publishing": [*offer.published],
            "services": [*offer.services, *self.names],
        }


def _text(asked: Mapping[str, Any], key: str) -> str:
    value = asked.get(key)
    if not isinstance(value, str):
        raise BadMessage(f"the request needs a text '{key}'")
    return value


def _rooted(asked: Mapping[str, Any], key: str) -> str:
    return "/" + _text(asked, key).lstrip("/")


def _of_type(names: Mapping[str, str], kind: str) -> list[str]:
    return [name for name, own in names.items() if kind in (own, own.replace("/msg/", "/").replace("/srv/", "/"))]


def _details(kind: str) -> Values:
    """The fields of a type and of all types that it uses, as rosapi_msgs/TypeDef."""
    try:
        root = definition(kind)
    except KeyError:
        raise BadMessage(f"unknown type '{kind[:80]}'") from None
    found: dict[str, Values] = {}

    def add(message: Message) -> None:
        if message.name in found:
            return
        elements = [field.type.element if isinstance(field.type, Array) else field.type for field in message.fields]
        sizes = [(field.type.length or 0) if isinstance(field.type, Array) else -1 for field in message.fields]
        found[message.name] = {
            "type": message.name,
            "fieldnames": [field.name for field in message.fields],
            "fieldtypes": [_name(element) for element in elements],
            "fieldarraylen": sizes,
            "examples": [_example(element, size) for element, size in zip(elements, sizes, strict=True)],
            "constnames": [],
            "constvalues": [],
        }
        for element in elements:
            if isinstance(element, Message):
                add(element)

    add(root)
    return {"typedefs": [*found.values()]}


def _name(kind: Type) -> str:
    match kind:
        case Number():
            return kind.name
        case Message():
            return kind.name
    return "string"


def _example(kind: Type, size: int) -> str:
    if size >= 0:
        return "[]"
    return "" if isinstance(kind, Text) else "{}" if isinstance(kind, Message) else "0"
