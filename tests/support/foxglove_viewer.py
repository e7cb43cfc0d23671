"""`axisync foxglove` as a user runs it, and a viewer of its own kind: what that shows comes from the wire alone.

https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md
"""

import base64
import json
import re
import struct
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from axisync_schemas.log_channels import Channel
from support.daemon import wait_for

SUBPROTOCOL = Subprotocol("foxglove.sdk.v1")
PATIENCE_S = 30.0
POLL_S = 0.1
_MESSAGE_DATA = struct.Struct("<BIQ")  # opcode, subscription, log time
_MESSAGE_OPCODE = 1


@dataclass(frozen=True, slots=True)
class Seen:
    """A message as it came; `log_time_ns` is wall time."""

    log_time_ns: int
    payload: bytes


class Viewer:
    """One connection; a context manager.

    Attributes:
        channels: what is advertised just now, by topic; `ids` the numbers of the channels.
        statuses: id to message of what the server says is wrong.
        parameters: as far as they came.
        metadata: of each channel, by topic.
    """

    def __init__(self, port: int) -> None:
        self._connection = connect(f"ws://127.0.0.1:{port}", subprotocols=[SUBPROTOCOL], max_size=None, max_queue=None)
        self.channels: dict[str, Channel] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.ids: dict[str, int] = {}
        self.statuses: dict[str, str] = {}
        self.parameters: dict[str, Any] = {}
        self.server: dict[str, Any] = {}
        self._subscribed: dict[int, str] = {}
        self._waiting: dict[str, deque[Seen]] = {}

    def __enter__(self) -> Self:
        self._socket = self._connection.__enter__()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._connection.__exit__(kind, error, trace)

    def send(self, **message: Any) -> None:
        """An operation."""
        self._socket.send(json.dumps(message))

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Takes what comes until `condition()` holds."""
        end = time.monotonic() + PATIENCE_S
        while not condition():
            left = end - time.monotonic()
            assert left > 0, f"not within {PATIENCE_S:g} s: {what}"
            try:
                self._take(self._socket.recv(timeout=min(left, POLL_S)))
            except TimeoutError:
                continue

    def subscribe(self, *topics: str) -> None:
        """From now on their messages come; waits until they are advertised."""
        self.until(lambda: set(topics) <= set(self.channels), f"{topics} advertised")
        for topic in topics:
            number = len(self._subscribed) + 1
            self._subscribed[number] = topic
            self._waiting[topic] = deque()
            self.send(op="subscribe", subscriptions=[{"id": number, "channelId": self.ids[topic]}])

    def messages(self, topic: str, count: int) -> list[Seen]:
        """The next ones."""
        self.until(lambda: self.arrived(topic) >= count, f"{count} of {topic}")
        return [self._waiting[topic].popleft() for _ in range(count)]

    def arrived(self, topic: str) -> int:
        """How many of a topic have come and were not taken yet."""
        return len(self._waiting[topic])

    def decoded(self, topic: str, count: int) -> list[Any]:
        """The next ones, decoded by nothing but the advertised schema."""
        channel = self.channels[topic]
        seen = self.messages(topic, count)
        if channel.encoding == "json":
            return [json.loads(one.payload) for one in seen]
        pool = DescriptorPool()
        for file in FileDescriptorSet.FromString(channel.schema).file:
            pool.Add(file)
        message = GetMessageClass(pool.FindMessageTypeByName(channel.name))
        return [message.FromString(one.payload) for one in seen]

    def _take(self, frame: str | bytes) -> None:
        if isinstance(frame, bytes):
            opcode, subscription, log_time_ns = _MESSAGE_DATA.unpack_from(frame)
            assert opcode == _MESSAGE_OPCODE
            payload = frame[_MESSAGE_DATA.size :]
            self._waiting[self._subscribed[subscription]].append(Seen(log_time_ns, payload))
            return
        message = json.loads(frame)
        operation = message["op"]
        if operation == "serverInfo":
            self.server = message
        elif operation == "advertise":
            for channel in message["channels"]:
                self._advertised(channel)
        elif operation == "unadvertise":
            gone = set(message["channelIds"])
            for topic in [topic for topic, number in self.ids.items() if number in gone]:
                del self.ids[topic], self.channels[topic]
        elif operation == "status":
            self.statuses[message["id"]] = message["message"]
        elif operation == "removeStatus":
            for one in message["statusIds"]:
                self.statuses.pop(one, None)
        elif operation == "parameterValues":
            self.parameters |= {one["name"]: one["value"] for one in message["parameters"]}

    def _advertised(self, channel: dict[str, Any]) -> None:
        topic, encoding = channel["topic"], channel["schemaEncoding"]
        text = channel["schema"]
        schema = base64.b64decode(text) if encoding == "protobuf" else text.encode()
        self.channels[topic] = Channel(topic, channel["encoding"], channel["schemaName"], encoding, schema)
        self.metadata[topic] = channel.get("metadata") or {}
        self.ids[topic] = channel["id"]


class LiveView:
    """One run of `axisync foxglove`; a context manager, after which nothing of it is left."""

    def __init__(self, directory: Path, endpoint: str, port: int = 0) -> None:
        self._output = directory / "foxglove.txt"
        command = [sys.executable, "-m", "axisync_cli", "foxglove", "--port", str(port), "--endpoint", endpoint]
        with self._output.open("wb") as output:
            self.process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT, cwd=directory
            )

    @property
    def output(self) -> str:
        """What it printed so far."""
        return self._output.read_text(encoding="utf-8", errors="replace")

    @property
    def port(self) -> int:
        """Where it serves, as it says; waits until it does."""
        wait_for(lambda: "live view: " in self.output or self.process.poll() is not None, "the live view", PATIENCE_S)
        found = re.search(r"ws://127\.0\.0\.1:(\d+)", self.output)
        assert found is not None, self.output
        return int(found[1])

    def said(self, text: str) -> None:
        """Waits until it has printed this."""
        wait_for(lambda: text in self.output, f"{text!r} said", PATIENCE_S)

    def end(self, number: int) -> int:
        """Ends it by a signal; its exit code."""
        self.process.send_signal(number)
        return self.process.wait(PATIENCE_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.process.kill()
        self.process.wait()
