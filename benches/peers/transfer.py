"""Motions played in MuJoCo: does what was learned here hold in another engine?

    pip install mujoco
    python benches/peers/transfer.py path/to/robot.urdf walk.motion.json trot.motion.json … [--seconds 10]

Each motion document is played from the standing pose with its own springs, dampers and torque limits, which is all that
a servo has; a feedforward of the document is left out, and said so. Prints the speed along the task's direction, the
change of heading and the time upright, beside those of the document, for several time constants of MuJoCo's soft
contact (its default of 20 ms is soft for fast gaits).
"""

import argparse
import json
import math

import mujoco
import numpy as np

import robot

STEP = 0.001
# A root that is tilted by more, rad, or lower than this share of its height has fallen.
FALLEN_TILT = 1.0
FALLEN_HEIGHT = 0.4


class Player:
    """Targets and their rates at any time: the entry once, then the loop for ever."""

    def __init__(self, motion):
        entry, keyframes = motion["entry"], motion["keyframes"]
        lead = entry[-1]["time"] if entry else 0.0
        knots = [(k["time"], k) for k in entry[:-1]] + [(lead + k["time"], k) for k in keyframes]
        self.times = np.array([time for time, _ in knots])
        self.angles = np.array([k["angles"] for _, k in knots])
        self.rates = np.array([k["velocities"] for _, k in knots])
        self.start = lead + motion["loop"]["start"]
        self.end = self.times[-1]

    def targets(self, time):
        if time >= self.end:
            time = self.start + (time - self.start) % (self.end - self.start)
        knot = min(int(np.searchsorted(self.times, time, side="right")), len(self.times) - 1) - 1
        length = self.times[knot + 1] - self.times[knot]
        s = (time - self.times[knot]) / length
        q0, q1, v0, v1 = self.angles[knot], self.angles[knot + 1], self.rates[knot], self.rates[knot + 1]
        end = 3 * s**2 - 2 * s**3
        angles = q0 + (q1 - q0) * end + length * (v0 * (s**3 - 2 * s**2 + s) + v1 * (s**3 - s**2))
        rates = 6 * (s - s**2) * (q1 - q0) / length + v0 * (3 * s**2 - 4 * s + 1) + v1 * (3 * s**2 - 2 * s)
        return angles, rates


def heading(quaternion):
    w, x, y, z = quaternion
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def play(urdf, motion, seconds, contact, step=STEP, itself=False):
    """Speed along the direction after the entry, change of heading, time upright, mean slip aside."""
    names, drive = motion["joints"], motion["drive"]
    gains = tuple(dict(zip(names, drive[key])) for key in ("stiffness", "damping", "max_torque"))
    model = robot.load(urdf, gains, friction=motion["scene"]["friction"], itself=itself)
    model.opt.timestep = step
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.geom_solref[:, 0] = contact
    data = mujoco.MjData(model)
    first = (motion["entry"] or motion["keyframes"])[0]
    place = first["root"]
    root = {key: place[key] for key in ("position", "orientation", "linear_velocity", "angular_velocity")}
    joints = {n: {"angle": a, "velocity": v} for n, a, v in zip(names, first["angles"], first["velocities"])}
    robot.start(model, data, {"root": root, "joints": joints})
    order = [names.index(model.actuator(index).name) for index in range(model.nu)]
    # A servo's damper acts on the rate of its error; MuJoCo's position servo damps the rate itself.
    stiffness = np.maximum(np.array(drive["stiffness"]), 1e-9)
    ahead = np.array(drive["damping"]) / stiffness
    player = Player(motion)
    direction = np.array(motion["provenance"]["task"].get("direction", [1, 0, 0])[:2], dtype=float)
    direction /= np.linalg.norm(direction)
    warm = player.end
    begun, turned, before = None, 0.0, heading(data.qpos[3:7])
    height, upright = data.qpos[2], 0.0
    while data.time < seconds - step / 2:
        angles, rates = player.targets(data.time + step)
        data.ctrl[:] = (angles + ahead * rates)[order]
        mujoco.mj_step(model, data)
        now = heading(data.qpos[3:7])
        turned += (now - before + math.pi) % (2 * math.pi) - math.pi
        before = now
        w, x, y, z = data.qpos[3:7]
        if 1 - 2 * (x * x + y * y) < math.cos(FALLEN_TILT) or data.qpos[2] < FALLEN_HEIGHT * height:
            break
        upright = data.time
        if begun is None and data.time >= warm:
            begun = (data.time, data.subtree_com[1][:2].copy() if model.nbody > 1 else data.qpos[:2].copy(), turned)
    if begun is None or upright <= begun[0]:
        return 0.0, turned, upright
    way = data.subtree_com[1][:2] - begun[1]
    return float(way @ direction) / (data.time - begun[0]), turned - begun[2], upright


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("urdf")
    parser.add_argument("motions", nargs="+")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--contact", type=float, nargs="+", default=[0.02, 0.01, 0.005], help="time constants, s")
    parser.add_argument("--self-collision", action="store_true", help="let the robot touch itself")
    options = parser.parse_args()
    for path in options.motions:
        motion = json.load(open(path))
        if motion["drive"]["feedforward"] != "none":
            print(f"{path}: played without its feedforward {motion['drive']['feedforward']}")
        ours = motion["metrics"]
        print(f"{path}: {ours['gait']} at {ours['speed']:.3f} m/s, upright {ours['upright_seconds']:.1f} s")
        for contact in options.contact:
            # A contact must be resolved by the step: MuJoCo takes no time constant below two of them.
            step = min(STEP, contact / 4)
            speed, turn, upright = play(options.urdf, motion, options.seconds, contact, step, options.self_collision)
            share = 100 * (speed / ours["speed"] - 1) if ours["speed"] else math.nan
            print(
                f"  contact {1000 * contact:g} ms: {speed:.3f} m/s ({share:+.0f} %), heading {turn:+.2f} rad, "
                f"upright {upright:.1f} s"
            )


if __name__ == "__main__":
    main()
