"""Makes the vectors: trajectories, and what reference.py says of them.

    python3 make_vectors.py [FOLDER]       this folder by default

No trajectory has a value near a threshold, where single and double precision would part.
"""

import json
import math
import sys
from pathlib import Path

import reference

ROBOT = {"radius_m": 0.2, "linear_max_mps": 1.0, "angular_max_radps": 1.0}
TOLERANCE = {"absolute": 1e-4, "relative": 1e-4}


def number(value):
    """Six decimals, never a minus zero."""
    return round(value, 6) + 0.0


def sampled(duration_s, dt_s, speed, turn):
    """Drives: speed (m/s) and turning rate (rad/s) as functions of time, each held for a step."""
    x, y, yaw, steps = 0.0, 0.0, 0.0, []
    for index in range(round(duration_s / dt_s)):
        t = (index + 1) * dt_s
        yaw = reference.wrapped(yaw + turn(t) * dt_s)
        x += speed(t) * dt_s * math.cos(yaw)
        y += speed(t) * dt_s * math.sin(yaw)
        steps.append((x, y, yaw, speed(t)))
    return steps


def case(about, steps, goal, *, start=(0.0, 0.0, 0.0), dt=0.1, shortest=None, clearance=lambda index: 1.0,
         approach=lambda index: None, hits=False, believes=False, robot=ROBOT, radius=0.3):
    indices = range(len(steps))
    contact = [hits and index == len(steps) - 1 for index in indices]
    column = lambda which: [number(step[which]) for step in steps]
    made = {
        "about": about,
        "robot": robot,
        "dt_s": dt,
        "start": dict(zip(["x_m", "y_m", "yaw_rad"], start)),
        "goal_m": list(goal),
        "goal_radius_m": radius,
        "shortest_way_m": shortest,
        "believes_it_arrived": believes,
        "steps": {
            "x_m": column(0),
            "y_m": column(1),
            "yaw_rad": column(2),
            "linear_mps": column(3),
            "clearance_m": [number(clearance(index)) for index in indices],
            "time_to_collision_s": [None if approach(index) is None else number(approach(index)) for index in indices],
            "contact": contact,
        },
        "tolerance": TOLERANCE,
    }
    found = reference.metrics(made)
    made["expected"] = {
        name: float(f"{value:.9g}") if isinstance(value, float) else value for name, value in found.items()
    }
    return made


def vectors():
    swell = lambda t: math.sin(math.pi * t / 4.0) ** 2
    yield "straight", case(
        "A straight drive at one speed: nothing to improve. The way driven is shorter than the shortest, as it ends at the rim of "
        "the goal: efficiencies are 1, not more. The speed never changes after the first step, but the first acceleration counts.",
        sampled(4.8, 0.1, lambda t: 1.0, lambda t: 0.0), (5.0, 0.0), shortest=5.0, clearance=lambda i: 2.0 - 0.03 * i,
        approach=lambda i: None if i < 10 else 5.5 - 0.1 * i)
    west = [(-0.08 * (i + 1), 0.0, 3.11 if i % 2 else -3.12, 0.8) for i in range(50)]
    yield "angle_wrap", case(
        "Due west, the heading sways across plus and minus pi: each step turns by 0.053 rad. Whoever subtracts headings without "
        "wrapping sees 6.23 rad and a smoothness of 0.",
        west, (-4.2, 0.1), start=(0.0, 0.0, 3.11), shortest=4.3)
    for name, dt in [("swell_10hz", 0.1), ("swell_20hz", 0.05)]:
        yield name, case(
            "Speed swells and falls as sin^2 over 4 s, sampled at 10 and at 20 Hz in two files: the same motion, so the logarithms of "
            "jerk are alike. Second differences that are not divided by dt^2 part by ln 16 = 2.8 after squaring.",
            sampled(4.0, dt, swell, lambda t: 0.2), (1.75, 0.75), dt=dt, shortest=1.9, clearance=lambda i: 0.6 + 0.002 * i,
            approach=lambda i: 3.0)
    yield "standing", case(
        "Does nothing until time is over: smooth, without jerk, and stood for all of it. Nothing is approached.",
        [(0.0, 0.0, 0.5, 0.0)] * 30, (3.0, 4.0), start=(0.0, 0.0, 0.5), shortest=6.5, clearance=lambda i: 0.4)
    yield "collision_at_the_goal", case(
        "Touches something in the step that reaches the goal: a collision, and no success. No efficiency, SPL 0.",
        sampled(2.8, 0.1, lambda t: 1.0, lambda t: 0.0), (3.0, 0.0), shortest=3.0, hits=True,
        clearance=lambda i: 0.8 - 0.03 * i, approach=lambda i: 2.7 - 0.1 * i)
    yield "timeout", case(
        "Out of time on the way, on a map without a known way: SPL and efficiency are absent, not 0.",
        sampled(3.0, 0.1, lambda t: 0.5 + 0.3 * math.sin(2.0 * t), lambda t: 0.4 * math.cos(3.0 * t)), (6.0, -2.0),
        clearance=lambda i: 0.5 + 0.4 * math.cos(0.3 * i), approach=lambda i: 2.0 + 0.5 * math.sin(i))
    yield "believed_arrived", case(
        "Stands where it wrongly believes the goal to be until time is over: no success; stood since it last strayed by 0.15 m.",
        sampled(4.0, 0.1, lambda t: 0.9 if t < 1.95 else 0.0, lambda t: 0.0), (2.5, 0.2), shortest=2.6, believes=True)
    yield "spin", case(
        "Turns on the spot at its fastest, through plus and minus pi, twice nearly round: from the moment on that 2 s lie behind its "
        "first step, every step is spin.",
        sampled(9.0, 0.1, lambda t: 0.0, lambda t: 1.0), (1.0, 1.0), shortest=1.5)
    yield "slow_turn_of_a_fast_turner", case(
        "Turns on the spot at 0.7 rad/s, a third of what this robot can: no spin, which 0.4 of its best would be.",
        sampled(6.0, 0.1, lambda t: 0.0, lambda t: 0.7), (1.0, 1.0), shortest=1.5,
        robot={**ROBOT, "angular_max_radps": 2.1})
    yield "large_and_slow", case(
        "A robot of twice the size and half the speed of the reference, at 5 Hz: its lengths count twice, its times four times. It "
        "drives, creeps for 0.05 m, which is standing, and turns on the spot: spin looks back over 8 s, 40 steps.",
        sampled(24.0, 0.2, lambda t: 0.45 if t < 5.9 else (0.012 if t < 9.9 else 0.0),
                lambda t: 0.0 if t < 9.9 else 0.6), (9.0, 0.0), dt=0.2, shortest=9.4,
        robot={"radius_m": 0.4, "linear_max_mps": 0.5, "angular_max_radps": 1.0}, radius=0.6)
    yield "small_and_turning", case(
        "A robot of half the reference's size counts as one of 0.7 of it. It creeps in a circle and turns just so fast that the 28 "
        "steps of its window are spin, and 27 would not be.",
        sampled(6.0, 0.1, lambda t: 0.053, lambda t: 0.407), (1.0, 1.0), shortest=1.5,
        robot={"radius_m": 0.1, "linear_max_mps": 0.5, "angular_max_radps": 1.0})
    yield "detour", case(
        "A half circle to a goal that could be reached more directly.",
        sampled(5.0, 0.08, lambda t: 0.8 * min(t, 1.0), lambda t: 0.5), (0.3, 3.0), dt=0.08, shortest=3.2, radius=0.5,
        clearance=lambda i: 0.3 + 0.01 * i, approach=lambda i: 1.5 if i == 20 else None)
    yield "backwards", case(
        "Backs away to a goal behind it: the peak speed is that of the fastest motion, whichever its sign.",
        sampled(4.0, 0.1, lambda t: -0.6 * min(t, 1.0), lambda t: 0.1 * math.sin(t)), (-2.1, 0.0), shortest=2.1)


def main():
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for name, made in vectors():
        # One column a line.
        steps = ",\n".join(f"    {json.dumps(key)}: {json.dumps(value)}" for key, value in made["steps"].items())
        text = json.dumps({**made, "steps": "STEPS"}, indent=2).replace('"STEPS"', "{\n" + steps + "\n  }")
        (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
