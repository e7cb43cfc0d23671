"""A first move: enable KingKong, swing its first axis by ten degrees and back.

Start `axisyncd demo` in another terminal, then: python clients/examples/first_move.py
"""

from axisync_client import AxisyncError, Client, deg


def main() -> int:
    try:
        with Client() as client, client.lease("kingkong") as arm:
            arm.enable()
            for step in (10, -10):
                move = arm.move_joint(deg(step, 0, 0, 0, 0, 0), relative=True)
                print(f"{step:+d} degrees in {move.reply.duration_s:.3f} s, set by {move.reply.limiting}")
                move.result()
    except AxisyncError as error:
        print(error)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
