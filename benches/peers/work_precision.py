"""Error against computing time of MuJoCo's integrators, in the measure of `gaitwright accuracy`.

    pip install mujoco
    python benches/peers/work_precision.py scenario.json --gaitwright target/release/gaitwright --out mujoco.csv

The scenario is one of gaitwright's: a URDF that plays a motion on a plane, or moves freely. MuJoCo gets the same robot,
start, servos, targets and friction; it chooses its own way of contact. Each integrator is compared with a run of RK4 at
a step 64 times finer than the finest here, in the same engine, so that what the engines model differently counts for
nothing: in pieces of 0.064 s, spread over the scenario, each begun in a state that MuJoCo itself reaches. The error is
the displacement of the bodies at the end of a piece, root mean square over the bodies and over the mass of each, mean
over the pieces. Computing time is that of the steps alone, of each piece the least of several repeats, per
simulated second.
"""

import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys
import time

import mujoco
import numpy as np

import robot

PIECES = 12
PIECE = 0.064
STEPS = [0.032 / 2**halvings for halvings in range(9)]
FINER = 64
INTEGRATORS = {
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "RK4": mujoco.mjtIntegrator.mjINT_RK4,
}
STATE = mujoco.mjtState.mjSTATE_INTEGRATION
COLUMNS = ["scene", "engine", "method", "step", "step_tolerance", "error", "seconds", "status"]
# Off by half a metre in 0.064 s is lost.
LOST = 0.5


class Track:
    """The targets of a motion document: its entry, then its loop over and over, by cubic Hermite splines."""

    def __init__(self, document):
        self.names = document["joints"]
        entry, keyframes = document.get("entry", []), document["keyframes"]
        lead = entry[-1]["time"] if entry else 0.0
        knots = entry[:-1] + [{**each, "time": each["time"] + lead} for each in keyframes]
        self.times, self.angles, self.rates = (
            np.array([each[key] for each in knots]) for key in ("time", "angles", "velocities")
        )
        self.loop = (document["loop"]["start"] + lead, document["loop"]["end"] + lead)

    def at(self, when):
        """Targets and their rates at the times `when`, s: a row each."""
        start, end = self.loop
        when = np.where(when > end, start + (when - start) % (end - start), when)
        index = np.clip(np.searchsorted(self.times, when, side="right"), 1, len(self.times) - 1)
        length = (self.times[index] - self.times[index - 1])[:, None]
        s = (when - self.times[index - 1])[:, None] / length
        q0, q1 = self.angles[index - 1], self.angles[index]
        v0, v1 = self.rates[index - 1], self.rates[index]
        angles = q0 + (q1 - q0) * (3 * s**2 - 2 * s**3) + length * (v0 * (s**3 - 2 * s**2 + s) + v1 * (s**3 - s**2))
        rates = 6 * (s - s**2) * (q1 - q0) / length + v0 * (3 * s**2 - 4 * s + 1) + v1 * (3 * s**2 - 2 * s)
        return angles, rates


class Scene:
    """A scenario in MuJoCo: a model, its start, and the controls of its servos."""

    def __init__(self, path, gaitwright):
        scenario = json.loads(path.read_text())
        world = scenario.get("scene", {})
        self.effects = world.get("effects", {})
        self.name, self.duration = path.name, scenario["duration"]
        drive = scenario.get("drive", {"kind": "none"})
        gains, self.track = None, None
        if drive["kind"] == "track":
            document = json.loads((path.parent / drive["motion"]).read_text())
            own = document["drive"]
            feedforward = drive.get("feedforward", own.get("feedforward", "none"))
            if feedforward != "none" or {"stiffness", "damping", "max_torque"} & drive.keys():
                sys.exit("the drive must have the motion's own gains and no feedforward")
            self.track = Track(document)
            gains = tuple(dict(zip(self.track.names, own[key])) for key in ("stiffness", "damping", "max_torque"))
        elif drive["kind"] != "none":
            sys.exit("the drive must be a motion or none")
        ground = world.get("ground", {"kind": "plane", "height": 0.0})
        if ground and (ground["kind"], ground["height"]) != ("plane", 0.0):
            sys.exit("the ground must be the plane at 0, or null")
        itself = self.effects.get("self_collision") != "off"
        self.model = robot.load(path.parent / scenario["character"], gains, bool(ground), world.get("friction", 0.8), itself)
        self.data = mujoco.MjData(self.model)
        for effect, flag in (
            ("joint_limits", mujoco.mjtDisableBit.mjDSBL_LIMIT),
            ("joint_damping", mujoco.mjtDisableBit.mjDSBL_DAMPER),
            ("gravity", mujoco.mjtDisableBit.mjDSBL_GRAVITY),
        ):
            if self.effects.get(effect) == "off":
                self.model.opt.disableflags |= flag
        robot.start(self.model, self.data, first_line(path, gaitwright))
        if self.track:
            self.order = [self.track.names.index(name) for name in robot.joints(self.model)]
            # With velocity feedback kv, a target velocity v adds kv v to the torque: as kv / kp of target.
            self.lead = -self.model.actuator_biasprm[:, 2] / self.model.actuator_gainprm[:, 0]

        # What a timed call from Python takes without any step is not MuJoCo's, s.
        self.call = min(self.timed_call() for _ in range(1000))

    def timed_call(self):
        started = time.perf_counter()
        mujoco.mj_step(self.model, self.data, 0)
        return time.perf_counter() - started

    def controls(self, begin, step, count):
        """Of every step of a piece, or None without servos.

        A control is held over a step. That of the step's middle makes the servos' error one of second order.
        """
        if self.track is None:
            return None
        angles, rates = self.track.at(begin + (np.arange(count) + 0.5) * step)
        return angles[:, self.order] + self.lead * rates[:, self.order]

    def run(self, step, count, controls):
        """Steps, and gives the seconds they took."""
        model, data, now = self.model, self.data, time.perf_counter
        model.opt.timestep = step
        if controls is None:
            started = now()
            mujoco.mj_step(model, data, count)
            return now() - started
        elapsed = 0.0
        for control in controls:
            data.ctrl[:] = control
            started = now()
            mujoco.mj_step(model, data)
            elapsed += now() - started
        return elapsed - count * self.call

    def state(self):
        state = np.zeros(mujoco.mj_stateSize(self.model, STATE))
        mujoco.mj_getState(self.model, self.data, state, STATE)
        return state

    def restart(self, state):
        mujoco.mj_setState(self.model, self.data, state, STATE)

    def places(self):
        """Centres of the bodies' masses, m, and their principal axes at the present state."""
        mujoco.mj_kinematics(self.model, self.data)
        return self.data.xipos[1:].copy(), self.data.ximat[1:].reshape(-1, 3, 3).copy()

    def displacement(self, ends):
        """Of the bodies from where they should be: root mean square over the bodies and the mass of each, m."""
        centers, axes = self.places()
        inertia = self.model.body_inertia[1:]
        # Second moments of the mass along the principal axes, over the mass, m^2.
        moments = (0.5 * inertia.sum(axis=1, keepdims=True) - inertia) / self.model.body_mass[1:, None]
        turned = np.einsum("bij,bj->b", (axes - ends[1]) ** 2, moments)
        return math.sqrt(np.mean(np.sum((centers - ends[0]) ** 2, axis=1) + turned))

    def choose(self, integrator, exact=False):
        """Sets the integrator; `exact` solves to rounding what otherwise MuJoCo's defaults solve."""
        self.model.opt.integrator = INTEGRATORS[integrator]
        self.model.opt.tolerance = 1e-12 if exact else 1e-8


def first_line(path, gaitwright):
    """The state in which gaitwright starts the scenario at `path`."""
    run = subprocess.run([gaitwright, "simulate", path], stdout=subprocess.PIPE, check=True)
    return json.loads(run.stdout.splitlines()[0])


def reference(scene):
    """Begin, state there and true end of every piece, and how far the latter is to be trusted, m."""
    finest = STEPS[-1]
    apart = round((scene.duration - PIECE) / (PIECES - 1) / finest)
    step = finest / FINER
    pieces, uncertainty = [], 0.0
    scene.choose("RK4", exact=True)
    starts = []
    for index in range(PIECES):
        starts.append((index * apart * finest, scene.state()))
        scene.run(finest, apart, scene.controls(starts[-1][0], finest, apart))
    for begin, state in starts:
        ends = None
        for own in (step, 2 * step):
            count = round(PIECE / own)
            scene.restart(state)
            scene.run(own, count, scene.controls(begin, own, count))
            if ends is None:
                ends = scene.places()
        uncertainty += scene.displacement(ends) / PIECES
        pieces.append((begin, state, ends))
    return pieces, uncertainty


def measure(scene, integrator, step, pieces, repeats):
    """Error, m, and computing seconds per simulated second."""
    count = round(PIECE / step)
    errors, seconds = [], 0.0
    scene.choose(integrator)
    for begin, state, ends in pieces:
        controls = scene.controls(begin, step, count)
        best = math.inf
        for _ in range(repeats):
            scene.restart(state)
            best = min(best, scene.run(step, count, controls))
        seconds += best
        errors.append(scene.displacement(ends))
    return float(np.mean(errors)), seconds / (len(pieces) * PIECE)


def rows(scene, pieces, repeats):
    """A row of the table for every integrator and step."""
    for integrator in INTEGRATORS:
        for step in STEPS:
            error, seconds = measure(scene, integrator, step, pieces, repeats)
            status = "measured" if error < LOST else "diverged"
            yield {
                "scene": scene.name,
                "engine": f"MuJoCo {mujoco.__version__}",
                "method": integrator,
                "step": step,
                "step_tolerance": math.nan,
                "error": error,
                "seconds": seconds,
                "status": status,
            }


def write(rows, path):
    """Leaves `rows` as comma-separated values; what a row has not is empty."""
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, COLUMNS)
        table.writeheader()
        for row in rows:
            table.writerow({key: "" if value != value else value for key, value in row.items()})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", type=pathlib.Path)
    parser.add_argument("--gaitwright", required=True, type=pathlib.Path, help="the program, for the scenario's start")
    parser.add_argument("--out", required=True, help="CSV to be written")
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    scene = Scene(options.scenario, options.gaitwright.resolve())
    pieces, uncertainty = reference(scene)
    print(f"the reference is certain to {uncertainty:.1e} m")
    found = list(rows(scene, pieces, options.repeats))
    write(found, options.out)
    for row in found:
        print(f"{row['method']:12} {row['step']:.6f} s  {row['error']:.2e} m  {row['seconds']:.2e} s/s  {row['status']}")


if __name__ == "__main__":
    main()
