"""What every command shares: where the daemon is, how to print, and in what form."""

import sys
from dataclasses import dataclass, field

from rich.console import Console, RenderableType
from rich.text import Text

from axisync_client import Client, Lease
from axisync_schemas.base import Strict


@dataclass
class Terminal:
    """Attributes: global options; `as_json`: of this command; `group`: what it is about, for sentences on errors."""

    endpoint: str | None = None
    cell: str | None = None
    user: str | None = None
    timeout_s: float = 5.0
    lease_ttl_s: float = 2.0
    as_json: bool = False
    group: str | None = None
    out: Console = field(default_factory=lambda: Console(highlight=False, soft_wrap=False))
    err: Console = field(default_factory=lambda: Console(stderr=True, highlight=False))

    def connect(self) -> Client:
        """A client of the daemon; use it in a `with`."""
        return Client(self.endpoint, cell=self.cell, user=self.user, timeout_s=self.timeout_s)

    def lease(self, client: Client, group: str, take: bool) -> Lease:
        """The lease of a command; use it in a `with`."""
        return client.lease(group, ttl_s=self.lease_ttl_s, take=take)

    def show(self, content: RenderableType) -> None:
        """For people: a table, or a sentence (never wrapped, so that it can be searched). Nothing with `--json`."""
        if not self.as_json:
            plain = isinstance(content, str | Text)
            self.out.print(content, soft_wrap=plain, markup=False)

    def reply(self, model: Strict) -> None:
        """For programs: the reply as one line of JSON. Nothing without `--json`."""
        if self.as_json:
            self.json_line(model.model_dump_json())

    @staticmethod
    def json_line(text: str) -> None:
        """One line on stdout, at once."""
        sys.stdout.write(text + "\n")
        sys.stdout.flush()

    def say(self, sentence: str) -> None:
        """On stderr: what went wrong, and how a move ended that a program waits for."""
        self.err.print(sentence, soft_wrap=True, markup=False)
