"""One table of topics: publishers, liveness checks, the log and tests read it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Topic:
    """A published stream.

    Attributes:
        name: key below `axisync/<cell>/`.
        rate_hz: messages a second; 0 for events.
        encoding: "json" or "protobuf".
        schema: name of the model or protobuf message of one sample.
        log: topic in the log, or None where it is not logged.
    """

    name: str
    rate_hz: float
    encoding: str
    schema: str
    log: str | None


STATE = Topic("state", 20.0, "json", "State", None)
EVENTS = Topic("events", 0.0, "json", "Event", "/events")
CYCLE = Topic("cycle", 1.0, "json", "CycleReport", None)
SETPOINTS = Topic("setpoints", 50.0, "protobuf", "axisync.SetpointBatch", "/setpoints")
ALIVE = "alive"
"""Liveliness token of the daemon, below `axisync/<cell>/`."""

PUBLISHED = (STATE, EVENTS, CYCLE, SETPOINTS)

LOG_SETPOINTS = "/setpoints"
LOG_REQUESTS = "/requests"
LOG_PLANS = "/plans"
LOG_EVENTS = "/events"
LOG_JOINT_STATES = "/joint_states"
"""foxglove.JointStates, for 3D viewers; made from every so manieth tick."""
LOG_LINES = "/log"
"""foxglove.Log: warnings and errors of all processes."""
JOINT_STATES_HZ = 50.0
