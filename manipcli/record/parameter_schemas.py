"""Types of rcl_interfaces for parameters of nodes."""

from __future__ import annotations

from typing import Final

PARAMETERS: Final[dict[str, str]] = {
    "rcl_interfaces/ParameterType": (
        "uint8 PARAMETER_NOT_SET=0\nuint8 PARAMETER_BOOL=1\nuint8 PARAMETER_INTEGER=2\nuint8 PARAMETER_DOUBLE=3\n"
        "uint8 PARAMETER_STRING=4\nuint8 PARAMETER_BYTE_ARRAY=5\nuint8 PARAMETER_BOOL_ARRAY=6\n"
        "uint8 PARAMETER_INTEGER_ARRAY=7\nuint8 PARAMETER_DOUBLE_ARRAY=8\nuint8 PARAMETER_STRING_ARRAY=9\n"
    ),
    "rcl_interfaces/ParameterValue": (
        "uint8 type\nbool bool_value\nint64 integer_value\nfloat64 double_value\nstring string_value\n"
        "byte[] byte_array_value\nbool[] bool_array_value\nint64[] integer_array_value\nfloat64[] double_array_value\n"
        "string[] string_array_value\n"
    ),
    "rcl_interfaces/Parameter": "string name\nrcl_interfaces/ParameterValue value\n",
    "rcl_interfaces/FloatingPointRange": "float64 from_value\nfloat64 to_value\nfloat64 step\n",
    "rcl_interfaces/IntegerRange": "int64 from_value\nint64 to_value\nuint64 step\n",
    "rcl_interfaces/ParameterDescriptor": (
        "string name\nuint8 type\nstring description\nstring additional_constraints\nbool read_only false\n"
        "bool dynamic_typing false\nrcl_interfaces/FloatingPointRange[<=1] floating_point_range\n"
        "rcl_interfaces/IntegerRange[<=1] integer_range\n"
    ),
    "rcl_interfaces/SetParametersResult": "bool successful\nstring reason\n",
    "rcl_interfaces/ListParametersResult": "string[] names\nstring[] prefixes\n",
    "rcl_interfaces/ListParameters_Request": "uint64 DEPTH_RECURSIVE=0\nstring[] prefixes\nuint64 depth\n",
    "rcl_interfaces/ListParameters_Response": "rcl_interfaces/ListParametersResult result\n",
    "rcl_interfaces/GetParameters_Request": "string[] names\n",
    "rcl_interfaces/GetParameters_Response": "rcl_interfaces/ParameterValue[] values\n",
    "rcl_interfaces/GetParameterTypes_Request": "string[] names\n",
    "rcl_interfaces/GetParameterTypes_Response": "uint8[] types\n",
    "rcl_interfaces/DescribeParameters_Request": "string[] names\n",
    "rcl_interfaces/DescribeParameters_Response": "rcl_interfaces/ParameterDescriptor[] descriptors\n",
    "rcl_interfaces/SetParameters_Request": "rcl_interfaces/Parameter[] parameters\n",
    "rcl_interfaces/SetParameters_Response": "rcl_interfaces/SetParametersResult[] results\n",
    "rcl_interfaces/SetParametersAtomically_Request": "rcl_interfaces/Parameter[] parameters\n",
    "rcl_interfaces/SetParametersAtomically_Response": "rcl_interfaces/SetParametersResult result\n",
}
