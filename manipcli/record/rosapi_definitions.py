"""Definitions of rosapi_msgs, the services by which clients of rosbridge ask for names and types (rosbridge_suite)."""

from __future__ import annotations

_TYPES = "rosapi_msgs/TypeDef[] typedefs\n"
_DONE = "bool successful\nstring reason\n"
_SERVICES = {
    "ActionFeedbackDetails": ("string type\n", _TYPES),
    "ActionGoalDetails": ("string type\n", _TYPES),
    "ActionResultDetails": ("string type\n", _TYPES),
    "ActionType": ("string action\n", "string type\n"),
    "DeleteParam": ("string name\n", _DONE),
    "GetActionServers": ("", "string[] action_servers\n"),
    "GetParam": ("string name\n", f"string value\n{_DONE}"),
    "GetParamNames": ("", "string[] names\n"),
    "GetROSVersion": ("", "uint8 version\nstring distro\n"),
    "GetTime": ("", "builtin_interfaces/Time time\n"),
    "HasParam": ("string name\n", "bool exists\n"),
    "Interfaces": ("", "string[] interfaces\n"),
    "MessageDetails": ("string type\n", _TYPES),
    "NodeDetails": ("string node\n", "string[] subscribing\nstring[] publishing\nstring[] services\n"),
    "Nodes": ("", "string[] nodes\n"),
    "Publishers": ("string topic\n", "string[] publishers\n"),
    "ServiceNode": ("string service\n", "string node\n"),
    "ServiceProviders": ("string service\n", "string[] providers\n"),
    "ServiceRequestDetails": ("string type\n", _TYPES),
    "ServiceResponseDetails": ("string type\n", _TYPES),
    "ServiceType": ("string service\n", "string type\n"),
    "Services": ("", "string[] services\n"),
    "ServicesForType": ("string type\n", "string[] services\n"),
    "SetParam": ("string name\nstring value\n", _DONE),
    "Subscribers": ("string topic\n", "string[] subscribers\n"),
    "TopicType": ("string topic\n", "string type\n"),
    "Topics": ("", "string[] topics\nstring[] types\n"),
    "TopicsAndRawTypes": ("", "string[] topics\nstring[] types\nstring[] typedefs_full_text\n"),
    "TopicsForType": ("string type\n", "string[] topics\n"),
}

ROSAPI: dict[str, str] = {
    "rosapi_msgs/TypeDef": (
        "string type\nstring[] fieldnames\nstring[] fieldtypes\nint32[] fieldarraylen\n"
        "string[] examples\nstring[] constnames\nstring[] constvalues\n"
    ),
    **{
        f"rosapi_msgs/{name}_{half}": text
        for name, halves in _SERVICES.items()
        for half, text in zip(("Request", "Response"), halves, strict=True)
    },
}
"""Text of each definition, by name."""
