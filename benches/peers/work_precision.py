"""Error against computing time of MuJoCo's integrators, in the measure of `gaitwright accuracy`.

    pip install mujoco
    python benches/peers/work_precision.py path/to/robot.urdf --check check.json --out mujoco.csv
    python benches/peers/work_precision.py path/to/robot.urdf --check check.json --motion motion.json --out mujoco.csv

Two scenes: `passive`, the robot without ground whose root and joints start at 1 rad/s, and with a motion document
`walking`, the motion played on a plane with friction 0.8. Servos have the document's stiffness and damping about its
targets and target velocities. Each integrator is compared with a much finer run of RK4 in the same engine, so that
what the engines model differently counts for nothing: in pieces of 0.1 s, each begun in a state of the fine run, the
error is the distance of the bodies' origins at the piece's end, root mean square over the bodies, mean over the
pieces. Computing time is that of the steps alone, the least of several repeats, per simulated second.
"""

import argparse
import csv
import json
import math
import time

import mujoco
import numpy as np

import robot

PIECE = 0.1
STEPS = [0.1 / pieces for pieces in (12, 25, 50, 100, 200, 400, 800)]
INTEGRATORS = {
    "euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "rk4": mujoco.mjtIntegrator.mjINT_RK4,
}
STATE = mujoco.mjtState.mjSTATE_INTEGRATION


class Track:
    """The targets of a motion document: its entry, then its loop over and over, by cubic Hermite splines."""

    def __init__(self, document):
        self.names = document["joints"]
        entry, keyframes = document.get("entry", []), document["keyframes"]
        self.begin = entry[-1]["time"] if entry else 0.0
        shifted = [{**each, "time": each["time"] + self.begin} for each in keyframes]
        self.keyframes = entry[:-1] + shifted
        self.times = [each["time"] for each in self.keyframes]
        self.loop = (document["loop"]["start"] + self.begin, document["loop"]["end"] + self.begin)

    def at(self, when):
        """Targets and their rates at `when` s."""
        start, end = self.loop
        if when > end:
            when = start + (when - start) % (end - start)
        index = min(max(np.searchsorted(self.times, when, side="right"), 1), len(self.times) - 1)
        before, after = self.keyframes[index - 1], self.keyframes[index]
        length = after["time"] - before["time"]
        s = (when - before["time"]) / length
        q0, v0, q1, v1 = (np.array(each[key]) for each in (before, after) for key in ("angles", "velocities"))
        angles = q0 + (q1 - q0) * (3 * s**2 - 2 * s**3) + length * (v0 * (s**3 - 2 * s**2 + s) + v1 * (s**3 - s**2))
        rates = 6 * (s - s**2) * (q1 - q0) / length + v0 * (3 * s**2 - 4 * s + 1) + v1 * (3 * s**2 - 2 * s)
        return angles, rates


class Scene:
    """A model, its start, and the controls of its servos."""

    def __init__(self, urdf, standing, document):
        self.track = Track(document) if document else None
        gains = None
        if document:
            drive = document["drive"]
            gains = tuple(dict(zip(document["joints"], drive[key])) for key in ("stiffness", "damping"))
        self.name = "walking" if document else "passive"
        self.model = robot.load(urdf, gains, ground=document is not None)
        if not document:
            self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self.data = mujoco.MjData(self.model)
        pose, height = standing["joints"], standing["root_height"]
        if document:
            pose = dict(zip(self.track.names, self.track.at(0.0)[0]))
        robot.place(self.model, self.data, pose, height)
        if document:
            order = [self.track.names.index(name) for name in robot.joints(self.model)]
            self.order = np.array(order)
            # With velocity feedback kv, a target velocity v adds kv v to the torque: as kv / kp of target.
            kp, kv = self.model.actuator_gainprm[:, 0], -self.model.actuator_biasprm[:, 2]
            self.lead = np.divide(kv, kp, out=np.zeros_like(kv), where=kp > 0)
        else:
            self.data.qvel[3:] = 1.0

    def controls(self, begin, step, count):
        """Of every step of a piece, or None without servos."""
        if self.track is None:
            return None
        controls = []
        for index in range(count):
            angles, rates = self.track.at(begin + index * step)
            controls.append(angles[self.order] + self.lead * rates[self.order])
        return controls

    def run(self, step, count, controls):
        """Steps and gives the seconds they took."""
        model, data = self.model, self.data
        model.opt.timestep = step
        if controls is None:
            started = time.perf_counter()
            mujoco.mj_step(model, data, count)
            return time.perf_counter() - started
        elapsed = 0.0
        for control in controls:
            data.ctrl[:] = control
            started = time.perf_counter()
            mujoco.mj_step(model, data)
            elapsed += time.perf_counter() - started
        return elapsed

    def state(self):
        state = np.zeros(mujoco.mj_stateSize(self.model, STATE))
        mujoco.mj_getState(self.model, self.data, state, STATE)
        return state

    def bodies(self):
        """Origins of the bodies at the present state, m."""
        mujoco.mj_kinematics(self.model, self.data)
        return self.data.xpos[1:].copy()


def reference(scene, pieces, step):
    """States at the beginning of every piece, and where the bodies are at the end of it."""
    scene.model.opt.integrator = INTEGRATORS["rk4"]
    count = round(PIECE / step)
    states, ends = [], []
    for piece in range(pieces):
        states.append(scene.state())
        scene.run(PIECE / count, count, scene.controls(piece * PIECE, PIECE / count, count))
        ends.append(scene.bodies())
    return states, ends


def measure(scene, integrator, step, states, ends, repeats):
    """Error, m, and computing seconds per simulated second."""
    count = round(PIECE / step)
    errors, seconds = [], 0.0
    scene.model.opt.integrator = INTEGRATORS[integrator]
    for piece, (state, end) in enumerate(zip(states, ends)):
        controls = scene.controls(piece * PIECE, step, count)
        best = math.inf
        for _ in range(repeats):
            mujoco.mj_setState(scene.model, scene.data, state, STATE)
            best = min(best, scene.run(step, count, controls))
        seconds += best
        errors.append(math.sqrt(np.mean(np.sum((scene.bodies() - end) ** 2, axis=1))))
    return float(np.mean(errors)), seconds / (len(states) * PIECE)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("urdf")
    parser.add_argument("--check", required=True, help="output of `gaitwright check`, for its standing pose")
    parser.add_argument("--motion", help="a motion document to be played")
    parser.add_argument("--out", required=True, help="CSV to be written")
    parser.add_argument("--pieces", type=int, default=10)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--reference-step", type=float, default=2e-6)
    options = parser.parse_args()
    document = json.load(open(options.motion)) if options.motion else None
    scene = Scene(options.urdf, json.load(open(options.check))["standing"], document)
    states, ends = reference(scene, options.pieces, options.reference_step)
    with open(options.out, "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["scene", "engine", "integrator", "step_s", "error_m", "seconds_per_second", "status"])
        for integrator in INTEGRATORS:
            for step in STEPS:
                error, seconds = measure(scene, integrator, step, states, ends, options.repeats)
                diverged = not error < 1.0
                status = "diverged" if diverged else "ok"
                engine = f"mujoco {mujoco.__version__}"
                row = [scene.name, engine, integrator, f"{step:.6g}", f"{error:.6g}", f"{seconds:.6g}", status]
                table.writerow(row)
                print(*row)


if __name__ == "__main__":
    main()
