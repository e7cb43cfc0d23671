"""Both arms at once: two lines under one clock, five centimetres backwards and forwards again.

Start `axisyncd demo` in another terminal, then: python clients/examples/two_arms.py
"""

from axisync_client import AxisyncError, Client, mm


def main() -> int:
    try:
        with Client() as client, client.lease("both") as arms:
            arms.enable()
            for step in (-50, 50):
                shift = mm(step, 0, 0)
                move = arms.move_linear({"kingkong": shift, "wukong": shift}, relative=True, frame="body")
                print(f"{step:+d} mm in {move.reply.duration_s:.3f} s, set by {move.reply.limiting}")
                move.result()
    except AxisyncError as error:
        print(error)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
