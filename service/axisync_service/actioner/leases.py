"""Who may command which group, and until when. A lease is proved by its token and fenced by its epoch."""

import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

from axisync_schemas.errors import ErrorCode, Refusal


@dataclass(slots=True)
class Lease:
    """A user's right to command `groups` until `until_ns` (monotonic), renewed by its token."""

    token: str
    user: str
    epoch: int
    until_ns: int
    groups: tuple[int, ...]


class Leases:
    """The lease of each elementary group, if any. At most one holds a group; one lease may hold several groups.

    Every change of hands gives the groups an epoch above all earlier ones of the cell, so that whatever was sent under
    an older lease can be told apart, here and in the controller.
    """

    def __init__(
        self, names: tuple[str, ...], epochs: tuple[int, ...], new_token: Callable[[], str] = secrets.token_urlsafe
    ) -> None:
        """`epochs`: those in shared memory; they go on growing over a restart, and no lease survives one."""
        self._names = names
        self._epoch = max(epochs, default=0)
        self._new_token = new_token
        self._held: list[Lease | None] = [None] * len(names)

    def acquire(self, user: str, groups: tuple[int, ...], ttl_ns: int, now_ns: int) -> Lease:
        """A new lease on free groups.

        Raises:
            Refusal: LEASE_HELD, naming the holder.
        """
        for group in groups:
            held = self.holder(group, now_ns)
            if held is not None:
                self._refuse_held(group, held, now_ns)
        return self._grant(user, groups, ttl_ns, now_ns)

    def take(self, user: str, groups: tuple[int, ...], ttl_ns: int, now_ns: int) -> tuple[Lease, list[Lease]]:
        """A new lease on groups whoever holds them, and the leases that lose groups to it."""
        losers: list[Lease] = []
        for group in groups:
            held = self._held[group]
            if held is not None:
                held.groups = tuple(g for g in held.groups if g != group)
                if held not in losers:
                    losers.append(held)
        return self._grant(user, groups, ttl_ns, now_ns), losers

    def renew(self, token: str | None, groups: tuple[int, ...], ttl_ns: int, now_ns: int) -> Lease:
        """The lease, prolonged on all groups it covers; it must cover `groups`.

        Raises:
            Refusal: LEASE_REQUIRED, LEASE_FENCED.
        """
        lease = self.verify(token, groups, now_ns)
        lease.until_ns = now_ns + ttl_ns
        return lease

    def release(self, token: str | None, groups: tuple[int, ...], now_ns: int) -> Lease:
        """Gives `groups` back; the lease keeps the others it covers.

        Raises:
            Refusal: LEASE_REQUIRED, LEASE_FENCED.
        """
        lease = self.verify(token, groups, now_ns)
        for group in groups:
            self._held[group] = None
        lease.groups = tuple(g for g in lease.groups if g not in groups)
        return lease

    def verify(self, token: str | None, groups: tuple[int, ...], now_ns: int) -> Lease:
        """The lease that `token` proves for every one of `groups`.

        Raises:
            Refusal: LEASE_REQUIRED without a token or where the lease does not cover a group; LEASE_FENCED for a
                token that is no longer, or never was, that of a lease.
        """
        if token is None:
            self._refuse_without(groups, now_ns)
        lease = next((held for held in self._held if held is not None and held.token == token), None)
        if lease is None or lease.until_ns <= now_ns:
            raise Refusal(
                ErrorCode.LEASE_FENCED,
                "this lease has lapsed, was released or taken over: acquire a new one",
                groups={self._names[g]: self._user(g, now_ns) for g in groups},
            )
        missing = [self._names[g] for g in groups if g not in lease.groups]
        if missing:
            raise Refusal(ErrorCode.LEASE_REQUIRED, f"this lease does not cover {', '.join(missing)}", missing=missing)
        return lease

    def holder(self, group: int, now_ns: int) -> Lease | None:
        """The lease on a group, unless it has lapsed."""
        lease = self._held[group]
        return lease if lease is not None and lease.until_ns > now_ns else None

    def lapse(self, now_ns: int) -> list[Lease]:
        """Removes the leases whose time is over, and returns them."""
        lapsed: list[Lease] = []
        for group, lease in enumerate(self._held):
            if lease is not None and lease.until_ns <= now_ns:
                self._held[group] = None
                if lease not in lapsed:
                    lapsed.append(lease)
        return lapsed

    def _grant(self, user: str, groups: tuple[int, ...], ttl_ns: int, now_ns: int) -> Lease:
        self._epoch += 1
        lease = Lease(self._new_token(), user, self._epoch, now_ns + ttl_ns, groups)
        for group in groups:
            self._held[group] = lease
        return lease

    def _user(self, group: int, now_ns: int) -> str | None:
        lease = self.holder(group, now_ns)
        return lease.user if lease is not None else None

    def _refuse_held(self, group: int, held: Lease, now_ns: int) -> NoReturn:
        raise Refusal(
            ErrorCode.LEASE_HELD,
            f"{self._names[group]} is held by {held.user}",
            group=self._names[group],
            holder=held.user,
            epoch=held.epoch,
            expires_in_s=(held.until_ns - now_ns) / 1e9,
        )

    def _refuse_without(self, groups: tuple[int, ...], now_ns: int) -> NoReturn:
        holders = {self._names[g]: self._user(g, now_ns) for g in groups}
        raise Refusal(ErrorCode.LEASE_REQUIRED, "this command needs a lease of the group", holders=holders)
