"""Goes on after refusals and faults: KingKong swings to and fro, whatever gets in its way.

Start `axisyncd demo` in another terminal, then: python clients/examples/fault_recovery.py

A fault to recover from: start the demo with `--control DIR`, and while this runs,
axisync-emulator inject DIR/kingkong.sock kind=emergency bus=kingkong node=1 code=0x2310 duration_s=0.2
"""

import sys
import time

from axisync_client import (
    AxisyncError,
    Client,
    ErrorCode,
    GroupState,
    Lease,
    MoveFailed,
    MoveHeld,
    Refused,
    deg,
)

GROUP = "kingkong"
ATTEMPTS, PAUSE_S = 10, 0.5


def ready(client: Client, arm: Lease) -> None:
    """Acknowledges a fault, if there is one, and switches the drives on. Tries again: the cause may still be there.

    Raises:
        Refused: the cause does not go away.
    """
    for attempt in range(ATTEMPTS):
        group = client.state().groups[GROUP]
        try:
            if group.state == GroupState.FAULT.label:
                print(f"fault: {group.reason}; resetting")
                arm.reset()
            arm.enable()
            return
        except Refused as refusal:
            if attempt == ATTEMPTS - 1:
                raise
            print(refusal)
            time.sleep(PAUSE_S)


def arrive(client: Client, arm: Lease, target: list[float], duration_s: float | None) -> None:
    """Moves to `target` in `duration_s` or, where that is too short, in the shortest possible time.

    Raises:
        AxisyncError: what this cannot recover from, or too many faults in a row.
    """
    for _ in range(ATTEMPTS):
        try:
            arm.move_joint(target, duration_s=duration_s).result()
            print("arrived")
            return
        except Refused as refusal:
            print(refusal)
            if refusal.code is ErrorCode.INFEASIBLE_DURATION:
                duration_s = None
            elif refusal.code in (ErrorCode.FAULTED, ErrorCode.NOT_ENABLED):
                ready(client, arm)
            else:
                raise
        except MoveFailed as failure:
            print(failure)
            ready(client, arm)
        except MoveHeld as held:  # by `axisync hold`, say
            print(held)
            arm.stop()
    raise AxisyncError(f"{GROUP} does not arrive", "`axisync state` and `axisync events` say more")


def main(swings: int) -> int:
    try:
        with Client() as client, client.lease(GROUP) as arm:
            ready(client, arm)
            here = client.state().groups[GROUP].setpoint
            there = [here[0] + deg(10)[0], *here[1:]]
            beyond = [10.0, *here[1:]]
            try:
                arm.move_joint(beyond)
            except Refused as refusal:
                print(f"{refusal.code}: the bound of {refusal.details['axis']} is {refusal.details['bound']:.3f} rad")
            for _ in range(swings):
                arrive(client, arm, there, duration_s=0.1)
                arrive(client, arm, list(here), duration_s=None)
    except AxisyncError as error:
        print(error)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 1))
