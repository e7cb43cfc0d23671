"""Cells of any size: one group a bus, all groups in one compound, axes as those of the demo's arms without geometry."""

_AXIS = """
[[groups.axes]]
name = "{group}.{axis}"
drive = {{ node_id = {axis}, emulator_start_deg = {start} }}
"""
_GROUP = """
[[groups]]
name = "{group}"

[groups.defaults]
soft_limits_deg = [-170, 170]
hard_limits_deg = [-180, 180]
limits = {{ velocity_deg_s = 30, acceleration_deg_s2 = 40, jerk_deg_s3 = 80 }}
stop_limits = {{ acceleration_deg_s2 = 60, jerk_deg_s3 = 240 }}

[groups.defaults.drive]
bus = "{group}"
counts_per_turn = 1048576
gear_ratio = 1.0
direction = 1
on_missed = "extrapolate"
following_error_max_deg = 2.0
quick_stop_deceleration_deg_s2 = 90
brake_release_ms = 60
identity = {{ vendor_id = 0x41584953, product_code = 0x00000001 }}
"""
_BUS = """
[[buses]]
name = "{group}"
interface = "socketcan"
channel = "vcan{bus}"
bitrate_kbit_s = 1000
"""


def scaled(buses: int, axes_per_bus: int) -> str:
    """The text of a cell file; groups are `arm0`, `arm1` ..., together `all_arms` where there are several."""
    names = [f"arm{bus}" for bus in range(buses)]
    text = 'schema = 1\nname = "scaled"\nperiod_ms = 2.0\nmissed_ticks_max = 5\n'
    text += "".join(_BUS.format(group=name, bus=bus) for bus, name in enumerate(names))
    for name in names:
        text += _GROUP.format(group=name)
        for axis in range(1, axes_per_bus + 1):
            text += _AXIS.format(group=name, axis=axis, start=10 * axis - 30)
    if buses > 1:
        members = ", ".join(f'"{name}"' for name in names)
        text += f'\n[[compounds]]\nname = "all_arms"\nmembers = [{members}]\n'
    return text
