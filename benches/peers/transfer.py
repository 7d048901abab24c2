"""Motions played in MuJoCo: does what was learned here hold in another engine?

    pip install mujoco
    python benches/peers/transfer.py path/to/robot.urdf walk.motion.json trot.motion.json … [--seconds 10]

A robot that is no URDF is given as the MuJoCo model of one of its motions (`gaitwright export --format mujoco`). Each motion document is played from the standing pose with its own springs, dampers and torque limits, which is all that
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


def rotated(q, v):
    """The vector v turned by the quaternion q."""
    w, u = q[0], np.asarray(q[1:])
    return v + 2 * np.cross(u, np.cross(u, v) + w * np.asarray(v))


def times(a, b):
    """The product of two quaternions."""
    w, u, s, v = a[0], np.asarray(a[1:]), b[0], np.asarray(b[1:])
    return np.concatenate([[w * s - u @ v], w * v + s * u + np.cross(u, v)])


class Steering:
    """What the cells of the trunk add to the keyframes of the loop."""

    def __init__(self, steering, start):
        self.forward = np.array([*steering["direction"], 0.0])
        self.left = np.cross([0.0, 0.0, 1.0], self.forward)
        self.tables = [
            (
                table["measure"],
                table["bounds"],
                np.array([[change["angles"] for change in ring] for ring in table["rings"]]),
                np.array([[change["velocities"] for change in ring] for ring in table["rings"]]),
            )
            for table in steering["tables"]
        ]
        self.back = np.array(start) * [1, -1, -1, -1]

    def measures(self, orientation, turning):
        """All measures of a root with this orientation and angular velocity in the world frame."""
        moved = times(orientation, self.back)
        heading = 2 * math.atan2(moved[3], moved[0])
        heading = math.atan2(math.sin(heading), math.cos(heading))
        level = np.array([math.cos(heading / 2), 0.0, 0.0, -math.sin(heading / 2)])
        up = rotated(level, rotated(moved, np.array([0.0, 0.0, 1.0])))
        turning = rotated(level, turning)
        return {
            "heading": heading,
            "forward_tilt": math.atan2(up @ self.forward, up[2]),
            "left_tilt": math.atan2(up @ self.left, up[2]),
            "forward_tilt_rate": turning @ self.left,
            "left_tilt_rate": -(turning @ self.forward),
        }

    def change(self, keyframe, measures):
        """What is added to angles and rates of a keyframe of the loop."""
        cells = [(np.searchsorted(bounds, measures[name], side="right"), a, v) for name, bounds, a, v in self.tables]
        return sum(a[cell, keyframe] for cell, a, _ in cells), sum(v[cell, keyframe] for cell, _, v in cells)


class Player:
    """Targets and their rates: the entry once, then the loop for ever, steered where the motion is."""

    def __init__(self, motion):
        entry, keyframes = motion["entry"], motion["keyframes"]
        lead = entry[-1]["time"] if entry else 0.0
        knots = [(k["time"], k) for k in entry[:-1]] + [(lead + k["time"], k) for k in keyframes]
        self.times = np.array([time for time, _ in knots])
        self.angles = np.array([k["angles"] for _, k in knots])
        self.rates = np.array([k["velocities"] for _, k in knots])
        self.start = lead + motion["loop"]["start"]
        self.end = self.times[-1]
        first = (motion["entry"] or motion["keyframes"])[0]["root"]["orientation"]
        steering = motion.get("steering")
        self.steering = Steering(steering, first) if steering else None
        self.first = int(np.argmin(np.abs(self.times - self.start)))
        none = np.zeros(len(motion["joints"]))
        self.segment, self.added = None, ((none, none), (none, none))

    def targets(self, time, orientation, turning):
        """At a time not before the last asked for, of a root with this orientation and angular velocity."""
        turns = 0
        if time >= self.end:
            turns, since = divmod(time - self.start, self.end - self.start)
            time = self.start + since
        knot = min(int(np.searchsorted(self.times, time, side="right")), len(self.times) - 1) - 1
        length = self.times[knot + 1] - self.times[knot]
        s = (time - self.times[knot]) / length
        q0, q1, v0, v1 = self.angles[knot], self.angles[knot + 1], self.rates[knot], self.rates[knot + 1]
        if self.steering:
            if (knot, turns) != self.segment:
                self.segment = (knot, turns)
                keyframe = (knot + 1 - self.first) % (len(self.times) - 1 - self.first)
                change = self.steering.change(keyframe, self.steering.measures(orientation, turning))
                self.added = (self.added[1], change)
            (a0, b0), (a1, b1) = self.added
            q0, q1, v0, v1 = q0 + a0, q1 + a1, v0 + b0, v1 + b1
        end = 3 * s**2 - 2 * s**3
        angles = q0 + (q1 - q0) * end + length * (v0 * (s**3 - 2 * s**2 + s) + v1 * (s**3 - s**2))
        rates = 6 * (s - s**2) * (q1 - q0) / length + v0 * (3 * s**2 - 4 * s + 1) + v1 * (3 * s**2 - 2 * s)
        return angles, rates


def heading(quaternion):
    w, x, y, z = quaternion
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def play(path, motion, seconds, contact, step=STEP, itself=False, elliptic=False):
    """Speed along the direction after the entry, change of heading, time upright. Friction is a pyramid, as it is by default, or an
    `elliptic` cone."""
    names, drive = motion["joints"], motion["drive"]
    gains = tuple(dict(zip(names, drive[key])) for key in ("stiffness", "damping", "max_torque"))
    model = robot.load(path, gains, friction=motion["scene"]["friction"], itself=itself)
    model.opt.timestep = step
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.geom_solref[:, 0] = contact
    if elliptic:
        model.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
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
        orientation = data.qpos[3:7].copy()
        # Of a free root, MuJoCo gives the angular velocity in the root's own frame.
        turning = rotated(orientation, data.qvel[3:6].copy())
        angles, rates = player.targets(data.time + step, orientation, turning)
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
    parser.add_argument("robot", help="URDF, or exported MuJoCo model")
    parser.add_argument("motions", nargs="+")
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--contact", type=float, nargs="+", default=[0.02, 0.01, 0.005], help="time constants, s")
    parser.add_argument("--self-collision", action="store_true", help="let the robot touch itself")
    parser.add_argument("--elliptic", action="store_true", help="friction as an elliptic cone, not as a pyramid")
    options = parser.parse_args()
    for path in options.motions:
        motion = json.load(open(path))
        if motion["drive"]["feedforward"] != "none":
            print(f"{path}: played without its feedforward {motion['drive']['feedforward']}")
        ours = motion["metrics"]
        loop = motion["loop"]
        rounds = options.seconds / (loop["end"] - loop["start"])
        print(
            f"{path}: {ours['gait']} at {ours['speed']:.3f} m/s, heading {rounds * loop['root_advance']['yaw']:+.2f} rad, "
            f"upright {ours['upright_seconds']:.1f} s{', steered' if motion.get('steering') else ''}"
        )
        for contact in options.contact:
            # A contact must be resolved by the step: MuJoCo takes no time constant below two of them.
            step = min(STEP, contact / 4)
            played = (options.robot, motion, options.seconds, contact, step, options.self_collision, options.elliptic)
            speed, turn, upright = play(*played)
            share = 100 * (speed / ours["speed"] - 1) if ours["speed"] else math.nan
            print(
                f"  contact {1000 * contact:g} ms: {speed:.3f} m/s ({share:+.0f} %), heading {turn:+.2f} rad, "
                f"upright {upright:.1f} s"
            )


if __name__ == "__main__":
    main()
