"""Services of rosapi, which clients of rosbridge ask for names and types; they only read.

`interfaces/rosapi_parameters.py` has those of parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from manipcli.live.command import Values
from manipcli.live.fields import arguments, rooted
from manipcli.live.offer import Offer
from manipcli.live.typedefs import typedefs
from manipcli.record.json_message import BadMessage, definition
from manipcli.record.schemas import schema_text

NODE: Final = "/manipcli"
"""The only node."""
_PREFIX: Final = "/rosapi/"
_Answer = Callable[[Mapping[str, Any]], Values]


class Rosapi:
    """Answers requests.

    Args:
        offer: names and types of the session.
        clock: returns the simulated time, builtin_interfaces/Time.

    Attributes:
        names: of its services.
    """

    def __init__(self, offer: Offer, clock: Callable[[], dict[str, int]]) -> None:
        self._offer, self._clock = offer, clock
        table: dict[str, tuple[str, _Answer]] = {
            "topics": ("Topics", lambda _: {"topics": [*offer.topics], "types": [*offer.topics.values()]}),
            "topics_and_raw_types": ("TopicsAndRawTypes", self._raw_types),
            "topic_type": ("TopicType", lambda asked: {"type": offer.topics.get(rooted(asked["topic"]), "")}),
            "topics_for_type": ("TopicsForType", lambda asked: {"topics": _of_type(offer.topics, asked["type"])}),
            "publishers": ("Publishers", lambda asked: {"publishers": _node_if(asked["topic"], offer.published)}),
            "subscribers": ("Subscribers", lambda asked: {"subscribers": _node_if(asked["topic"], offer.received)}),
            "interfaces": ("Interfaces", lambda _: {"interfaces": sorted(self._interfaces)}),
            "services": ("Services", lambda _: {"services": [*self._services]}),
            "service_type": (
                "ServiceType", lambda asked: {"type": self._services.get(rooted(asked["service"]), "")}
            ),
            "services_for_type": (
                "ServicesForType", lambda asked: {"services": _of_type(self._services, asked["type"])}
            ),
            "service_providers": (
                "ServiceProviders", lambda asked: {"providers": _node_if(asked["service"], self._services)}
            ),
            "service_node": (
                "ServiceNode", lambda asked: {"node": "".join(_node_if(asked["service"], self._services))}
            ),
            "action_servers": ("GetActionServers", lambda _: {"action_servers": [*offer.actions]}),
            "action_type": ("ActionType", lambda asked: {"type": offer.actions.get(rooted(asked["action"]), "")}),
            "nodes": ("Nodes", lambda _: {"nodes": [NODE]}),
            "node_details": ("NodeDetails", self._node_details),
            "get_time": ("GetTime", lambda _: {"time": self._time()}),
            "get_ros_version": ("GetROSVersion", lambda _: {"version": 2, "distro": "manipcli"}),
            "message_details": ("MessageDetails", lambda asked: typedefs(asked["type"])),
            **{
                f"{_snake(what)}_details": (f"{what}Details", _details(half))
                for what, half in (
                    ("ServiceRequest", "_Request"), ("ServiceResponse", "_Response"), ("ActionGoal", "_Goal"),
                    ("ActionResult", "_Result"), ("ActionFeedback", "_Feedback"),
                )
            },
        }  # fmt: skip
        self._table = {
            f"{_PREFIX}{name}": (f"rosapi_msgs/srv/{kind}", answer) for name, (kind, answer) in table.items()
        }
        self.names = tuple(self._table)

    @property
    def _services(self) -> dict[str, str]:
        """All services and their types."""
        return {**{name: kind for name, (kind, _) in self._table.items()}, **self._offer.services}

    @property
    def _interfaces(self) -> set[str]:
        """All types that the session uses."""
        offer = self._offer
        return {*offer.topics.values(), *offer.actions.values(), *self._services.values()}

    def call(self, name: str, request: object) -> Values:
        """The response of a service.

        Args:
            name: one of `names`.
            request: its fields, or a list of their values.

        Raises:
            BadMessage: the request is not valid, or asks for something unknown.
        """
        kind, answer = self._table[name]
        return answer(arguments(definition(f"{kind}_Request"), request))

    @property
    def now(self) -> dict[str, int]:
        """The simulated time, builtin_interfaces/Time."""
        return self._clock()

    def _time(self) -> dict[str, int]:
        """The fields of ROS 2 and those of ROS 1, which roslibpy reads."""
        now = self.now
        return {**now, "secs": now["sec"], "nsecs": now["nanosec"]}

    def _raw_types(self, asked: Mapping[str, Any]) -> Values:
        topics = self._offer.topics
        texts = [schema_text(kind) for kind in topics.values()]
        return {"topics": [*topics], "types": [*topics.values()], "typedefs_full_text": texts}

    def _node_details(self, asked: Mapping[str, Any]) -> Values:
        if rooted(asked["node"]) != NODE:
            raise BadMessage(f"unknown node; the only one is {NODE}")
        offer = self._offer
        return {
            "subscribing": [*offer.received],
            "publishing": [*offer.published],
            "services": [*self._services],
        }


def _details(half: str) -> _Answer:
    """The types of a part of a service or an action, such as `_Request`."""
    return lambda asked: typedefs(f"{asked['type']}{half}")


def _node_if(name: str, names: Mapping[str, str]) -> list[str]:
    """The node if it has this name."""
    return [NODE] if rooted(name) in names else []


def _of_type(names: Mapping[str, str], kind: str) -> list[str]:
    return [name for name, own in names.items() if kind in (own, own.replace("/msg/", "/").replace("/srv/", "/"))]


def _snake(name: str) -> str:
    """`service_request` of `ServiceRequest`."""
    return "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name).lstrip("_")
