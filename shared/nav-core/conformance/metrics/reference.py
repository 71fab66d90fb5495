"""The metrics of an episode, written once more from README.md, in the plainest way and in double precision.

    python3 reference.py [FILE ...]        checks the vectors (all *.json beside this file by default)

Needs nothing but Python 3. Exit status 1 where an expected value is not reproduced.
"""

import json
import math
import sys
from pathlib import Path

# Of a robot of 0.2 m radius that drives 1 m/s; for others times the factors of `scale`.
STOOD_M = 0.15
SPIN_WINDOW_S = 2.0
SPIN_MOVED_M = 0.25
SPIN_TURNED_SHARE = 0.4


def scale(robot):
    """Factors of lengths and of times."""
    length = max(robot["radius_m"] / 0.2, 0.7)
    return length, length / robot["linear_max_mps"]


def wrapped(angle):
    """The same angle in [-pi, pi]."""
    return math.atan2(math.sin(angle), math.cos(angle))


def end_of(case):
    """How the episode ended. A contact ends it, also in the step that reaches the goal."""
    steps = case["steps"]
    if any(steps["contact"][:-1]):
        raise ValueError("an episode ends with its first contact")
    if steps["contact"][-1]:
        return "collision"
    here = (steps["x_m"][-1], steps["y_m"][-1])
    if math.dist(here, case["goal_m"]) <= case["goal_radius_m"]:
        return "success"
    return "believed_arrived" if case["believes_it_arrived"] else "timeout"


def log_jerk(speeds, dt):
    """-ln(T^3 / v_peak^2 * integral of the squared second derivative of the speed); None where that has no logarithm."""
    accelerations = [(now - before) / dt for before, now in zip([0.0] + speeds, speeds)]
    jerks = [(now - before) / dt for before, now in zip(accelerations, accelerations[1:])]
    integral = sum(jerk * jerk * dt for jerk in jerks)
    peak = max(abs(speed) for speed in speeds)
    if integral == 0.0 or peak == 0.0:
        return None
    return -math.log((len(speeds) * dt) ** 3 * integral / peak**2)


def stood_s(points, dt, far_m):
    """For how long the robot had been near one place; points from the start on."""
    place, steps = points[0], 0
    for point in points[1:]:
        steps += 1
        if math.dist(point, place) > far_m:
            place, steps = point, 0
    return steps * dt


def spin(points, turns, window, moved_m, turned_rad):
    """Share of steps whose last `window` steps moved little and turned much; points and turns of the steps, without the start."""
    count = 0
    for now in range(window, len(points)):
        before = now - window
        moved = math.dist(points[now], points[before])
        turned = sum(turns[before + 1 : now + 1])
        count += moved < moved_m and turned > turned_rad
    return count / len(points)


def metrics(case):
    """Every metric of an episode."""
    dt, steps, goal = case["dt_s"], case["steps"], case["goal_m"]
    length, time = scale(case["robot"])
    start = case["start"]
    points = [(start["x_m"], start["y_m"])] + list(zip(steps["x_m"], steps["y_m"]))
    yaws = [start["yaw_rad"]] + steps["yaw_rad"]
    turns = [abs(wrapped(now - before)) for before, now in zip(yaws, yaws[1:])]
    count = len(turns)

    end = end_of(case)
    path = sum(math.dist(a, b) for a, b in zip(points, points[1:]))
    straight = math.dist(points[0], goal)
    shortest = case["shortest_way_m"]
    is_success = end == "success"

    def efficiency(reference):
        return reference / max(path, reference)

    known = shortest is not None
    approached = [seconds for seconds in steps["time_to_collision_s"] if seconds is not None]
    window = max(1, math.floor(SPIN_WINDOW_S * time / dt + 1e-6))
    turned = SPIN_TURNED_SHARE * case["robot"]["angular_max_radps"] * SPIN_WINDOW_S * time
    return {
        "end": end,
        "steps": count,
        "time_s": count * dt,
        "path_m": path,
        "geodesic_m": shortest,
        "euclidean_m": straight,
        "distance_left_m": math.dist(points[-1], goal),
        "spl": (efficiency(shortest) if is_success else 0.0) if known else None,
        "path_efficiency": efficiency(shortest) if known and is_success else None,
        "path_efficiency_euclidean": efficiency(straight) if is_success else None,
        "smoothness": sum(1.0 - min(turn / (math.pi / 2.0), 1.0) for turn in turns) / count,
        "log_jerk": log_jerk(steps["linear_mps"], dt),
        "clearance_min_m": min(steps["clearance_m"]),
        "clearance_mean_m": sum(steps["clearance_m"]) / count,
        "time_to_collision_min_s": min(approached, default=None),
        "stood_at_end_s": stood_s(points, dt, STOOD_M * length),
        "spin": spin(points[1:], turns, window, SPIN_MOVED_M * length, turned),
    }


def is_near(ours, expected, tolerance):
    """Whether a value is the expected one; words, counts and absent values must be equal."""
    if isinstance(expected, float) and isinstance(ours, (int, float)):
        return abs(ours - expected) <= tolerance["absolute"] + tolerance["relative"] * abs(expected)
    return ours == expected


def main():
    files = [Path(name) for name in sys.argv[1:]] or sorted(Path(__file__).parent.glob("*.json"))
    wrong = 0
    for file in files:
        case = json.loads(file.read_text(encoding="utf-8"))
        ours, expected = metrics(case), case["expected"]
        if ours.keys() != expected.keys():
            wrong += 1
            print(f"{file.name}: other metrics: {sorted(ours.keys() ^ expected.keys())}")
            continue
        for name, value in expected.items():
            if not is_near(ours[name], value, case["tolerance"]):
                wrong += 1
                print(f"{file.name}: {name} is {ours[name]}, not {value}")
    print(f"{len(files)} vectors, {wrong} differences")
    return 1 if wrong or not files else 0


if __name__ == "__main__":
    sys.exit(main())
