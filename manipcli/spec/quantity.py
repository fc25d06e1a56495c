"""Numbers with units, converted to SI once: a bare number is SI, a text is a number and a unit (`"45 deg"`)."""
# CONTRACT STUB (spec owner implements): Annotated[float, BeforeValidator(...), json schema] types.
from typing import Annotated

Length = Annotated[float, "m"]
Angle = Annotated[float, "rad"]
Mass = Annotated[float, "kg"]
Time = Annotated[float, "s"]
Force = Annotated[float, "N"]
Speed = Annotated[float, "m/s"]
JointValue = Annotated[float, "rad or m"]  # revolute and prismatic alike: accepts angle or length text
JointVelocity = Annotated[float, "rad/s or m/s"]
JointAcceleration = Annotated[float, "rad/s2 or m/s2"]
JointJerk = Annotated[float, "rad/s3 or m/s3"]
JointEffort = Annotated[float, "N m or N"]
Frequency = Annotated[float, "Hz"]
