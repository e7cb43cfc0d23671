from google.protobuf.internal import containers as _containers
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from collections.abc import Iterable as _Iterable, Mapping as _Mapping
from typing import ClassVar as _ClassVar, Optional as _Optional, Union as _Union

DESCRIPTOR: _descriptor.FileDescriptor

class SetpointTick(_message.Message):
    __slots__ = ("tick", "cycle_start_ns", "lateness_ns", "skipped", "position", "velocity", "acceleration", "jerk", "target_counts", "position_actual", "statusword", "plan_id", "path_s", "path_rate", "group_state")
    TICK_FIELD_NUMBER: _ClassVar[int]
    CYCLE_START_NS_FIELD_NUMBER: _ClassVar[int]
    LATENESS_NS_FIELD_NUMBER: _ClassVar[int]
    SKIPPED_FIELD_NUMBER: _ClassVar[int]
    POSITION_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_FIELD_NUMBER: _ClassVar[int]
    ACCELERATION_FIELD_NUMBER: _ClassVar[int]
    JERK_FIELD_NUMBER: _ClassVar[int]
    TARGET_COUNTS_FIELD_NUMBER: _ClassVar[int]
    POSITION_ACTUAL_FIELD_NUMBER: _ClassVar[int]
    STATUSWORD_FIELD_NUMBER: _ClassVar[int]
    PLAN_ID_FIELD_NUMBER: _ClassVar[int]
    PATH_S_FIELD_NUMBER: _ClassVar[int]
    PATH_RATE_FIELD_NUMBER: _ClassVar[int]
    GROUP_STATE_FIELD_NUMBER: _ClassVar[int]
    tick: int
    cycle_start_ns: int
    lateness_ns: int
    skipped: int
    position: _containers.RepeatedScalarFieldContainer[float]
    velocity: _containers.RepeatedScalarFieldContainer[float]
    acceleration: _containers.RepeatedScalarFieldContainer[float]
    jerk: _containers.RepeatedScalarFieldContainer[float]
    target_counts: _containers.RepeatedScalarFieldContainer[int]
    position_actual: _containers.RepeatedScalarFieldContainer[float]
    statusword: _containers.RepeatedScalarFieldContainer[int]
    plan_id: _containers.RepeatedScalarFieldContainer[int]
    path_s: _containers.RepeatedScalarFieldContainer[float]
    path_rate: _containers.RepeatedScalarFieldContainer[float]
    group_state: _containers.RepeatedScalarFieldContainer[int]
    def __init__(self, tick: _Optional[int] = ..., cycle_start_ns: _Optional[int] = ..., lateness_ns: _Optional[int] = ..., skipped: _Optional[int] = ..., position: _Optional[_Iterable[float]] = ..., velocity: _Optional[_Iterable[float]] = ..., acceleration: _Optional[_Iterable[float]] = ..., jerk: _Optional[_Iterable[float]] = ..., target_counts: _Optional[_Iterable[int]] = ..., position_actual: _Optional[_Iterable[float]] = ..., statusword: _Optional[_Iterable[int]] = ..., plan_id: _Optional[_Iterable[int]] = ..., path_s: _Optional[_Iterable[float]] = ..., path_rate: _Optional[_Iterable[float]] = ..., group_state: _Optional[_Iterable[int]] = ...) -> None: ...

class SetpointBatch(_message.Message):
    __slots__ = ("ticks", "seq")
    TICKS_FIELD_NUMBER: _ClassVar[int]
    SEQ_FIELD_NUMBER: _ClassVar[int]
    ticks: _containers.RepeatedCompositeFieldContainer[SetpointTick]
    seq: int
    def __init__(self, ticks: _Optional[_Iterable[_Union[SetpointTick, _Mapping]]] = ..., seq: _Optional[int] = ...) -> None: ...
