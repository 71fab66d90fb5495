"""A robot driver in small: a pretend base in an empty room. What travels is described in docs/topics.md.

pip install iceoryx2==0.10.0; python3 driver.py [ROBOT [IPC_ROOT]]
"""

import math
import os
import sys
import time
from ctypes import Structure, c_float, c_uint32, c_uint64

import iceoryx2 as iox2

PERIOD_S, COMMAND_AGE_S = 0.1, 0.25
LIMITS = {"linear": (1.0, 2.0), "angular": (1.0, 4.0)}  # m/s and m/s², rad/s and rad/s²
BEAMS, RANGE_MAX_M = 72, 5.0
ROOM_M = (4.0, 3.0)  # from the middle to the walls


def message(name, *fields):
    """A structure under its versioned type name, behind stamp and sequence number."""
    members = {"_fields_": [("stamp_ns", c_uint64), ("seq", c_uint64), *fields]}
    return type(name, (Structure,), {**members, "type_name": staticmethod(lambda: f"hybridnav/{name}/v1")})


def floats(*names):
    return [(name, c_float) for name in names]


LaserScan = message("LaserScan", *floats("angle_min", "angle_increment", "range_min", "range_max"),
                    ("beam_count", c_uint32), ("reserved", c_uint32), ("ranges", c_float * 1440))
Odometry = message("Odometry", *floats("x", "y", "yaw", "linear", "angular"), ("reserved", c_uint32))
Goal = message("Goal", *floats("x", "y", "radius"), ("id", c_uint32))
CmdVel = message("CmdVel", *floats("linear", "angular"), ("scan_seq", c_uint64), ("faults", c_uint32),
                 ("state", c_uint32))

robot = sys.argv[1] if len(sys.argv) > 1 else "robot"
root = sys.argv[2] if len(sys.argv) > 2 else f"/tmp/hybridnav-{os.geteuid()}"
os.makedirs(root, mode=0o700, exist_ok=True)
digits = 0x811C9DC5
for byte in root.encode():
    digits = (digits ^ byte) * 0x01000193 % 2**32
config = iox2.config.default()
config.global_cfg.root_path = iox2.Path.new(root)
config.global_cfg.prefix = iox2.FileName.new(f"nav{digits:08x}_")
# The program's own handling of Ctrl-C stays; what killed processes left is removed by whoever starts, not by who ends.
config.global_cfg.node.cleanup_dead_nodes_on_destruction = False
node = iox2.NodeBuilder.new().config(config).create(iox2.ServiceType.Ipc)


def topic(name, kind):
    return node.service_builder(iox2.ServiceName.new(f"hybridnav/{robot}/{name}")).publish_subscribe(
        kind).max_publishers(1).open_or_create()


def writer(name, kind):
    event = node.service_builder(iox2.ServiceName.new(f"hybridnav/{robot}/{name}")).event().open_or_create()
    publisher, notifier = topic(name, kind).publisher_builder().create(), event.notifier_builder().create()
    return lambda sent: (publisher.send_copy(sent), notifier.notify())


send_odom, send_goal, send_scan = writer("odom", Odometry), writer("goal", Goal), writer("scan", LaserScan)
commands = topic("cmd_vel", CmdVel).subscriber_builder().create()


def wall_m(x, y, angle):
    """From a place to the wall in a direction."""
    ways = [(half - at * math.copysign(1, along)) / max(abs(along), 1e-9)
            for at, along, half in ((x, math.cos(angle), ROOM_M[0]), (y, math.sin(angle), ROOM_M[1]))]
    return min(ways) if min(ways) <= RANGE_MAX_M else math.inf


x, y, yaw, speed = -2.5, -1.0, 0.0, {"linear": 0.0, "angular": 0.0}
wish, wish_ns, seq, deadline_ns = dict(speed), 0, 0, time.monotonic_ns()
while True:
    now_ns, seq = time.monotonic_ns(), seq + 1
    while (sample := commands.receive()) is not None:
        command = sample.payload().contents
        if wish_ns < command.stamp_ns <= time.monotonic_ns():
            wish, wish_ns = {"linear": command.linear, "angular": command.angular}, command.stamp_ns
        sample.delete()
    obeyed = now_ns - wish_ns <= COMMAND_AGE_S * 1e9 and all(map(math.isfinite, wish.values()))
    for axis, (speed_max, change_max) in LIMITS.items():
        target = max(-speed_max, min(speed_max, wish[axis])) if obeyed else 0.0
        step = change_max * PERIOD_S
        speed[axis] += max(-step, min(step, target - speed[axis]))
    yaw = math.remainder(yaw + speed["angular"] * PERIOD_S, math.tau)
    x, y = x + speed["linear"] * PERIOD_S * math.cos(yaw), y + speed["linear"] * PERIOD_S * math.sin(yaw)

    send_odom(Odometry(now_ns, seq, x, y, yaw, speed["linear"], speed["angular"], 0))
    send_goal(Goal(now_ns, seq, 2.0, 1.0, 0.3, 1))
    scan = LaserScan(now_ns, seq, -math.pi, math.tau / BEAMS, 0.05, RANGE_MAX_M, BEAMS, 0)
    for beam in range(BEAMS):
        scan.ranges[beam] = wall_m(x, y, yaw - math.pi + beam * math.tau / BEAMS)
    send_scan(scan)  # last, because it wakes the runtime
    deadline_ns = max(deadline_ns + int(PERIOD_S * 1e9), time.monotonic_ns())
    time.sleep(max(0, deadline_ns - time.monotonic_ns()) / 1e9)
