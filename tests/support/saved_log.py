"""Logs as the service writes them, by the recorder's own writer, of sessions that were computed instead of played."""

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from axisync_schemas.cell import Cell, read_cell
from axisync_schemas.plan_slots import codes_as_text
from axisync_schemas.ticks import Records
from axisync_service.recorder.clocks import ClockPair
from axisync_service.recorder.log_file import LogFile
from support.plans import tables_of
from support.recording import CELL
from support.synthetic import MONOTONIC_NS, REST_TICKS, WALL_NS, Session

CLOCKS = ClockPair(monotonic_ns=MONOTONIC_NS, wall_ns=WALL_NS)
STOP_TICK = 900
DISTANCE = -1.0
"""Of the first axis, rad; this way the others stay within their hard limits."""
Said = tuple[str, int, dict[str, Any]]
"""Topic, tick, message."""
Edit = Callable[[Records], Records | None]
"""Changes the ticks before they are written; may return others."""


@cache
def cell() -> Cell:
    return read_cell(CELL)[0]


@cache
def session(stop_tick: int | None = None, group: str = "kingkong", distance: float = DISTANCE) -> Session:
    return Session(cell(), group, stop_tick, distance)


def ticks_of(one: Session) -> Records:
    """The session's ticks, each drive one tick behind."""
    ticks: Records = np.array(one.records, dtype=one.layout.dtype)
    ticks["position_actual"][0] = ticks["position"][0]
    ticks["position_actual"][1:] = ticks["position"][:-1]
    ticks["lateness_ns"] = 1000 + 37 * (ticks["tick"] % 100)
    ticks["statusword"] = 0x1637
    return ticks


@cache
def plan_of(one_id: int, stop_tick: int | None, group: str, distance: float) -> dict[str, Any]:
    one = session(stop_tick, group, distance)
    tables = tables_of(one.cell, one.axes, one.trajectory)
    plan = one.log().plans[1]
    rates = {
        "rate_codes": codes_as_text(tables.codes), "rate_shape": tables.codes.shape[1:],
        "rate_limits": tables.limits.tolist(),
    }  # fmt: skip
    move = {"kind": "joint", "target": list(plan["end"]), "relative": False}
    asked = {"move_id": "m-1", "user": "ann", "request_id": "r-1", "move": move, "speed_scale": 1.0}
    return {**plan, **rates, **asked}


def at_tick(tick: int) -> int:
    """Monotonic instant of a tick."""
    return MONOTONIC_NS + tick * cell().period_ns


def event(kind: str, tick: int, text: str = "", group: str | None = "kingkong", **details: object) -> dict[str, Any]:
    return {
        "source": "controller", "kind": kind, "now_s": at_tick(tick) / 1e9, "wall_time": "", "message": text or kind,
        "tick": tick, "group": group, "details": details,
    }  # fmt: skip


def story_of(one: Session, stop_tick: int | None, group: str, distance: float) -> list[Said]:
    """Topic, tick and message: what processes said of the session."""
    last = REST_TICKS + int((np.array(one.records, dtype=one.layout.dtype)["plan_id"] != 0).any(axis=1).sum())
    status = "succeeded" if stop_tick is None else "stopped"
    request = {
        "request_id": "r-1", "user": "ann", "verb": "move", "body": {"group": group},
        "received_s": at_tick(1) / 1e9, "answered_s": at_tick(2) / 1e9, "reply": {"move_id": "m-1"},
    }  # fmt: skip
    told: list[Said] = [
        ("/requests", 2, request),
        ("/plans", 2, plan_of(1, stop_tick, group, distance)),
        ("/events", REST_TICKS, event("move_started", REST_TICKS, group=group, plan_id=1)),
        ("/events", last, event("move_ended", last, group=group, plan_id=1, status=status, reason=None)),
    ]
    if stop_tick is not None:
        at = REST_TICKS + stop_tick
        stop = {**request, "request_id": "r-2", "user": "bob", "verb": "stop", "reply": {}}
        told.append(("/requests", at - 1, stop))
        told.append(("/events", at, event("move_stopping", at, "slows", group, plan_id=1, reason="stop")))
    return told


class Maker:
    """Writes logs into a directory of the test's own."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory

    def write(
        self,
        stop_tick: int | None = None,
        edit: Edit | None = None,
        group: str = "kingkong",
        distance: float = DISTANCE,
        cell_text: str | None = None,
        more: list[Said] | None = None,
        story: bool = True,
        span: slice = slice(None),
        finish: bool = True,
    ) -> Path:
        """A log of one move; `span`: the ticks that this file has."""
        one = session(stop_tick, group, distance)
        ticks = ticks_of(one)
        edited = edit(ticks) if edit is not None else None
        ticks = (ticks if edited is None else edited)[span]
        told = (story_of(one, stop_tick, group, distance) if story else []) + (more or [])
        return save(self._directory, ticks, told, cell_text, finish)


def save(
    directory: Path, ticks: Records, story: list[Said], cell_text: str | None = None, finish: bool = True
) -> Path:  # fmt: skip
    """A log of these ticks and messages."""
    log = LogFile(directory, cell(), cell_text or CELL.read_text(), CLOCKS)
    told = sorted(story, key=lambda said: said[1])
    for record in ticks:
        while told and told[0][1] < record["tick"]:
            _tell(log, *told.pop(0))
        log.add_tick(record.tobytes(), int(record["tick"]), int(record["cycle_start_ns"]))
    for topic, tick, data in told:
        _tell(log, topic, tick, data)
    if finish:
        log.finish()
    else:
        log.flush()
        log.abandon()
    return log.path


def _tell(log: LogFile, topic: str, tick: int, data: dict[str, Any]) -> None:
    log.add_json(topic, at_tick(tick), json.dumps(data).encode())
