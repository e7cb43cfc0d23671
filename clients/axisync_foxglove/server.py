"""Foxglove's WebSocket server: channels as a log declares them, robot descriptions as parameters, and what is wrong.

Whoever connects looks and can send nothing: neither messages nor parameters are taken. A viewer that is too slow loses
the oldest messages; nobody waits for it.
"""

from types import TracebackType
from typing import Self

from foxglove import Channel, Context, Parameter, Schema, StatusLevel, start_server
from foxglove.websocket import Capability, Client, ServerListener

from axisync_client import AxisyncError, ErrorCode
from axisync_foxglove.live_log import Message, live_channels
from axisync_schemas.cell import Cell
from axisync_schemas.log_channels import labels, robot_descriptions
from axisync_schemas.topics import LOG_SETPOINTS

TROUBLE = "axisync"
"""Id of the one status that may be shown."""


class CannotServe(AxisyncError):
    """The address is taken, or none of this machine's."""

    code = ErrorCode.UNAVAILABLE


class FoxgloveServer:
    """Serves from its construction to `close`; a context manager.

    Raises:
        CannotServe: nobody can be served there.
    """

    def __init__(self, name: str, host: str, port: int) -> None:
        """`port`: 0 takes a free one, which `port` then names."""
        self._context = Context()
        self._channels: dict[str, Channel] = {}
        self._parameters = _Parameters()
        try:
            self._server = start_server(
                name=name,
                host=host,
                port=port,
                capabilities=[Capability.Parameters],
                server_listener=self._parameters,
                context=self._context,
            )
        except RuntimeError as error:
            why = str(error).removeprefix("FoxgloveError: ")
            raise CannotServe(f"cannot serve on {host}:{port} ({why})", "choose another --host or --port") from None
        self.port = self._server.port

    def offer(self, cell: Cell) -> None:
        """Declares the channels of a cell, in the place of those of the one before."""
        for channel in self._channels.values():
            channel.close()
        self._channels = {
            one.topic: Channel(
                one.topic,
                message_encoding=one.encoding,
                schema=Schema(name=one.name, encoding=one.schema_encoding, data=one.schema),
                metadata=labels(cell) if one.topic == LOG_SETPOINTS else {},
                context=self._context,
            )
            for one in live_channels()
        }
        self._parameters.texts = robot_descriptions(cell)

    def send(self, message: Message) -> None:
        """To whoever has subscribed to its topic."""
        self._channels[message.topic].log(message.payload, log_time=message.wall_ns)

    def trouble(self, sentence: str) -> None:
        """Says to all viewers what is wrong, in the place of what was said before."""
        self._server.publish_status(sentence, StatusLevel.Error, TROUBLE)

    def well(self) -> None:
        """Nothing is wrong any more."""
        self._server.remove_status([TROUBLE])

    def close(self) -> None:
        """Ends all connections."""
        self._server.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _Parameters(ServerListener):
    """Robot descriptions to read, each under its file's name; written are they never."""

    def __init__(self) -> None:
        self.texts: dict[str, str] = {}

    def on_get_parameters(
        self, client: Client, param_names: list[str], request_id: str | None = None
    ) -> list[Parameter]:
        """The named ones, or all where none is named."""
        wanted = param_names or list(self.texts)
        return [Parameter(name, value=self.texts[name]) for name in wanted if name in self.texts]

    def on_set_parameters(
        self, client: Client, parameters: list[Parameter], request_id: str | None = None
    ) -> list[Parameter]:
        """They stay as they are."""
        return self.on_get_parameters(client, [parameter.name for parameter in parameters])
