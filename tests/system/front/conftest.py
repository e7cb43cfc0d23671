"""Front and the planner worker as real processes; the controller is a peer of this test, which speaks its protocol."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar
from uuid import uuid4

import pytest
import zenoh

from axisync_motion.trajectory import Trajectory
from axisync_schemas.cell import Cell, read_cell
from axisync_schemas.enumerations import GroupState, Phase
from axisync_schemas.errors import ErrorBody
from axisync_schemas.events import EventKind
from axisync_schemas.internal import (
    CONTROLLER_COMMAND,
    CONTROLLER_STATUS,
    MAX_PACKET,
    BeginCommand,
    BusStatus,
    ControllerEvent,
    ControllerReply,
    ControllerStatus,
    DriveStatus,
    GroupCommand,
    GroupStatus,
)  # fmt: skip
from axisync_schemas.memory import (
    Control,
    GroupWord,
    Mailbox,
    Region,
    TimingRing,
    Word,
    create,
    region_sizes,
)  # fmt: skip
from axisync_schemas.plan_slots import Plan, read_plan
from axisync_schemas.replies import Event
from axisync_schemas.tick_ring import TickRing, slots_for
from axisync_schemas.ticks import TickLayout

CELL = Path(__file__).parents[3] / "service" / "axisync_service" / "cells" / "eod.toml"
T = TypeVar("T")

STEP_S = 0.004
BOOT_S = 20.0


@dataclass
class Group:
    """One group of the peer."""

    state: GroupState = GroupState.DISABLED
    plan: Plan | None = None
    slot: int = -1
    path_s: float = 0.0
    members: tuple[int, ...] = ()
    ending: str = ""


class ControllerPeer(threading.Thread):
    """Ticks, obeys, plays plans `pace` seconds of path a tick; stops and lapses at once instead of on a ramp."""

    def __init__(self, cell: Cell, regions: dict[str, Region], control: Control, listening: socket.socket) -> None:
        super().__init__(name="controller-peer", daemon=True)
        self.cell, self.control = cell, control
        self.layout = TickLayout(len(cell.axes), len(cell.groups))
        self.ring = TickRing(regions["ticks"].map(), self.layout, slots_for(cell.period))
        self.mailbox = Mailbox(regions["status"].map())
        self.timings = TimingRing(regions["timings"].map())
        self.plans = regions["plans"].map()
        self.listening = listening
        self.connection: socket.socket | None = None
        self.groups = [Group() for _ in cell.groups]
        self.position = [axis.drive.start for axis in cell.axes]
        self.stops = [0] * len(cell.groups)
        self.pace = 0.5
        self.commands: list[GroupCommand | BeginCommand] = []
        self.refuse: ErrorBody | None = None
        self.silent = False
        self.running = True
        self.tick = 0

    def run(self) -> None:
        """Ticks until told to end."""
        self.listening.setblocking(False)
        while self.running:
            if not self.silent:
                self.step()
            time.sleep(STEP_S)

    def step(self) -> None:
        """One tick, in the order of the real one: observe, decide what the next record shows, write this one."""
        self.tick += 1
        record = self._record()
        self._obey()
        self._play()
        self.ring.write(self.tick, record)
        self.control[Word.CONTROLLER_TICK] = self.tick
        self.timings.write(self.tick, 20_000, 1000, 2000, 3000, 4000, 0)
        self._status()
        self.control[Word.CONTROLLER_NS] = time.monotonic_ns()

    def _record(self) -> Any:
        record = self.layout.new()
        record["tick"] = self.tick
        record["position"] = record["position_actual"] = self.position
        record["plan_id"] = [g.plan.plan_id if g.plan else 0 for g in self.groups]
        record["path_s"] = [g.path_s if g.plan else 0.0 for g in self.groups]
        record["path_rate"] = [1.0 if g.state is GroupState.MOVING else 0.0 for g in self.groups]
        record["group_state"] = [int(g.state) for g in self.groups]
        return record

    def _obey(self) -> None:
        if self.connection is None:
            with contextlib.suppress(BlockingIOError):
                self.connection, _ = self.listening.accept()
                self.connection.setblocking(False)
        while self.connection is not None:
            try:
                packet = self.connection.recv(MAX_PACKET)
            except BlockingIOError:
                return
            if not packet:
                self.drop()
                return
            self._command(CONTROLLER_COMMAND.validate_json(packet))

    def drop(self) -> None:
        """Ends the connection."""
        if self.connection is not None:
            self.connection.close()
            self.connection = None

    def _command(self, command: GroupCommand | BeginCommand) -> None:
        self.commands.append(command)
        error = self.refuse
        members = self.cell.members(command.group)
        if error is None and isinstance(command, BeginCommand):
            plan = read_plan(self.plans, command.slot, command.plan_id)
            assert plan.start.tolist() == [self.position[i] for i in plan.axes]
            assert command.epochs == tuple(self.control.group(m, GroupWord.LEASE_EPOCH) for m in members)
            for member in members:
                self.groups[member] = Group(GroupState.MOVING, plan, command.slot, 0.0, members)
        elif error is None and isinstance(command, GroupCommand):
            state = GroupState.DISABLED if command.op == "disable" else GroupState.STANDSTILL
            for member in members:
                self.groups[member] = Group(state)
        self._send(ControllerReply(ref=command.ref, tick=self.tick, error=error).model_dump_json())

    def _play(self) -> None:
        for index, group in enumerate(self.groups):
            count = self.control.group(index, GroupWord.STOP_COUNT)
            stopped, self.stops[index] = count != self.stops[index], count
            if group.plan is None:
                continue
            lapsed = self.control.group(index, GroupWord.LEASE_UNTIL_NS) < time.monotonic_ns()
            if stopped:
                self.end(group, "stopped", "stop")
            elif (lapsed or self.connection is None) and group.state is GroupState.MOVING:
                for member in group.members:
                    self.groups[member].state = GroupState.HELD
            elif group.state is GroupState.MOVING and index == group.members[0]:
                self._advance(group)

    def _advance(self, group: Group) -> None:
        plan = group.plan
        assert plan is not None
        path_s = min(group.path_s + self.pace, plan.duration)
        trajectory = Trajectory(plan.knots, plan.coefficients, plan.start, plan.end)
        for axis, value in zip(plan.axes.tolist(), trajectory.evaluate(path_s)[0].tolist(), strict=True):
            self.position[axis] = value
        for member in group.members:
            self.groups[member].path_s = path_s
        if path_s == plan.duration:
            self.end(group, "succeeded", None)

    def end(self, group: Group, status: str, reason: str | None) -> None:
        """A move's end, and its event."""
        assert group.plan is not None
        details = {"plan_id": group.plan.plan_id, "status": status, "reason": reason, "group_name": "?"}
        for member in group.members:
            self.groups[member] = Group(GroupState.STANDSTILL)
        self.say(EventKind.MOVE_ENDED, details)

    def say(self, kind: EventKind, details: dict[str, Any]) -> None:
        """An event to front."""
        event = Event(
            source="controller", kind=kind, now_s=time.monotonic_ns() / 1e9, wall_time="", message=kind,
            tick=self.tick, details=details,
        )  # fmt: skip
        self._send(ControllerEvent(event=event).model_dump_json())

    def _send(self, text: str) -> None:
        if self.connection is not None:
            with contextlib.suppress(OSError):
                self.connection.send(text.encode())

    def _status(self) -> None:
        status = ControllerStatus(
            tick=self.tick,
            now_ns=time.monotonic_ns(),
            groups=tuple(
                GroupStatus(
                    state=int(g.state), plan_id=g.plan.plan_id if g.plan else 0, slot=g.slot, reason=None, ready=True
                )
                for g in self.groups
            ),
            drives=(DriveStatus(state=5, nmt=5, statusword=0x1237, error_code=0, error=None),) * len(self.cell.axes),
            buses=(BusStatus(state="up", load=0.5, sent=1, received=2, lost=0),) * len(self.cell.buses),
            skipped_ticks=0,
        )
        self.mailbox.write(CONTROLLER_STATUS.dump_json(status))


WARM_S = 60.0


class Refused(Exception):
    """A typed error from the daemon."""

    def __init__(self, body: dict[str, Any]) -> None:
        super().__init__(f"{body['code']}: {body['message']}")
        self.code: str = body["code"]
        self.body = body


@dataclass
class Client:
    """A Zenoh client that speaks the contract by hand."""

    session: zenoh.Session
    cell: str
    events: list[dict[str, Any]] = field(default_factory=list)

    def ask(self, key: str, payload: bytes | None = None, timeout: float = 10.0) -> Any:
        """The one reply; raises `Refused` for an error."""
        replies = list(self.session.get(f"axisync/{self.cell}/{key}", payload=payload, timeout=timeout))
        assert len(replies) == 1, [str(r.err.payload.to_string() if r.err else r.ok) for r in replies]
        if replies[0].ok is not None:
            return json.loads(replies[0].ok.payload.to_bytes())
        assert replies[0].err is not None
        raise Refused(json.loads(replies[0].err.payload.to_bytes()))

    def command(self, verb: str, user: str = "anonymous", **fields: Any) -> Any:
        """A command with a request_id of its own, unless given one."""
        body = {"request_id": str(uuid4())} | fields
        return self.ask(f"cmd/{user}/{verb}", json.dumps(body).encode())

    def refused(self, verb: str, **fields: Any) -> dict[str, Any]:
        """The error body of a command that must be refused."""
        with pytest.raises(Refused) as caught:
            self.command(verb, **fields)
        return caught.value.body

    def lease(self, *groups: str, ttl_s: float = 30.0) -> str:
        """A lease by force."""
        return str(self.command("lease", action="take", groups=list(groups or ("both",)), ttl_s=ttl_s)["lease"])

    def move(self, group: str, lease: str, target: list[float], **fields: Any) -> Any:
        """A joint move; asked for again while the planner warms up."""
        move = {"target": target, "relative": True} | fields
        deadline = time.monotonic() + WARM_S
        while True:
            try:
                return self.command("move", group=group, lease=lease, move=move)
            except Refused as refused:
                if refused.body["message"] != "the planner is not there" or time.monotonic() > deadline:
                    raise
            time.sleep(0.2)

    def report(self, move_id: str) -> Any:
        """Where a move is."""
        return self.ask(f"moves/{move_id}")

    def subscribe(self) -> None:
        """Collects events from now on."""
        self.session.declare_subscriber(
            f"axisync/{self.cell}/events", lambda sample: self.events.append(json.loads(sample.payload.to_bytes()))
        )


class Service:
    """What the supervisor does, as far as front and the planner need it."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.cell, text = read_cell(CELL)
        (directory / "cell.toml").write_text(text)
        sizes = region_sizes(self.cell.period, len(self.cell.axes), len(self.cell.groups))
        self.regions = create(sizes)
        self.control = Control(self.regions["control"].map(), len(self.cell.groups))
        self.log, self.log_write = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.log.setblocking(False)
        self.listening = {name: self._listen(name) for name in ("controller", "planner")}
        self.port = _free_port()
        self.peer = self.new_peer()
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self.peer.start()

    def _listen(self, name: str) -> socket.socket:
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        listening.bind(str(self.directory / f"{name}.sock"))
        listening.listen(4)
        return listening

    def new_peer(self) -> ControllerPeer:
        """A controller that is not running yet."""
        return ControllerPeer(self.cell, self.regions, self.control, self.listening["controller"])

    def spawn(self, name: str, listen: str | None = None) -> subprocess.Popen[bytes]:
        """Starts front or planner_worker."""
        fds = {region.name: region.descriptor for region in self.regions.values()}
        fds["log"] = self.log_write.fileno()
        if name == "planner_worker":
            fds["planner_listen"] = self.listening["planner"].fileno()
        arguments = [
            sys.executable, "-m", f"axisync_service.{name}",
            "--cell", str(self.directory / "cell.toml"),
            "--run-dir", str(self.directory),
            "--log-dir", str(self.directory),
            "--listen", listen or f"tcp/127.0.0.1:{self.port}",
            "--fds", ",".join(f"{key}:{fd}" for key, fd in fds.items()),
        ]  # fmt: skip
        with (self.directory / f"{name}.stderr").open("ab") as errors:
            process = subprocess.Popen(arguments, pass_fds=tuple(fds.values()), stderr=errors)
        self.processes[name] = process
        return process

    def errors(self, name: str) -> str:
        """What a process wrote to stderr."""
        return (self.directory / f"{name}.stderr").read_text()

    def kill(self, name: str) -> None:
        """kill -9, as a crash."""
        self.processes[name].kill()
        self.processes[name].wait()

    @contextlib.contextmanager
    def blocked_port(self) -> Iterator[int]:
        """A port that somebody else listens on."""
        with socket.socket() as other:
            other.bind(("127.0.0.1", 0))
            other.listen()
            yield other.getsockname()[1]

    def client(self, port: int | None = None) -> Client:
        """A connected client of the running front, through `port` where given."""
        config = zenoh.Config()
        for key, value in {
            "mode": "client",
            "connect/endpoints": [f"tcp/127.0.0.1:{port or self.port}"],
            "scouting/multicast/enabled": False,
            "transport/shared_memory/enabled": False,
        }.items():
            config.insert_json5(key, json.dumps(value))
        session = until(lambda: _opened(config), BOOT_S)
        alive = f"axisync/{self.cell.name}/alive"
        until(lambda: [reply for reply in session.liveliness().get(alive) if reply.ok], BOOT_S)
        return Client(session, self.cell.name)

    def entries(self) -> list[dict[str, Any]]:
        """Log entries since the last call."""
        found = []
        with contextlib.suppress(BlockingIOError):
            while True:
                found.append(json.loads(self.log.recv(MAX_PACKET)))
        return found

    def ready(self, client: Client) -> None:
        """Waits until front has seen the controller."""
        until(lambda: client.ask("state")["controller"] == "up", BOOT_S)

    def close(self) -> None:
        """Ends everything that this started."""
        self.control[Word.PHASE] = Phase.CLOSING
        for process in self.processes.values():
            with contextlib.suppress(ProcessLookupError):
                process.send_signal(signal.SIGCONT)
            try:
                process.wait(8.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self.peer.running = False
        self.peer.join()
        self.peer.drop()
        for one in (*self.listening.values(), self.log, self.log_write):
            one.close()
        for region in self.regions.values():
            os.close(region.descriptor)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def _opened(config: zenoh.Config) -> zenoh.Session | None:
    try:
        return zenoh.open(config)
    except zenoh.ZError:
        return None


def until(found: Callable[[], T], timeout_s: float = 5.0) -> T:
    """Asks until there is a true answer."""
    deadline = time.monotonic() + timeout_s
    while True:
        answer = found()
        if answer:
            return answer
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.005)


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """Front, planner and the peer, for a whole file of tests."""
    running = Service(tmp_path_factory.mktemp("run"))
    try:
        running.spawn("front")
        running.spawn("planner_worker")
        yield running
    finally:
        running.close()


@pytest.fixture
def client(service: Service) -> Iterator[Client]:
    """A client, with both groups enabled, at rest where the emulator starts, and no lease held over."""
    client = service.client()
    try:
        service.ready(client)
        service.peer.refuse, service.peer.silent, service.peer.pace = None, False, 0.5
        client.command("stop")
        lease = client.lease()
        client.command("enable", group="all", lease=lease)
        until(lambda: all(g["state"] == "standstill" for g in client.ask("state")["groups"].values()))
        client.command("lease", action="release", groups=["both"], lease=lease)
        service.peer.commands.clear()
        service.entries()
        yield client
    finally:
        client.session.close()


@pytest.fixture
def refused() -> Callable[..., dict[str, Any]]:
    """Error body of a call that must be refused."""

    def call(work: Callable[..., Any], *arguments: Any) -> dict[str, Any]:
        with pytest.raises(Refused) as caught:
            work(*arguments)
        return caught.value.body

    return call


@pytest.fixture
def refusal() -> type[Exception]:
    """What a refused call raises."""
    return Refused


@pytest.fixture
def new_service() -> Callable[[Path], Service]:
    """Makes a service whose processes the test starts itself."""
    return Service
