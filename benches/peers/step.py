"""The scene of `benches/step.rs` in MuJoCo and in gaitwright: steps a second on one core, default solvers.

    pip install mujoco
    python benches/peers/step.py path/to/a1.urdf [--check check.json] [--self-collision | --dry-friction]

A free root is added, the robot stands on a plane with friction 0.8, position servos sway by 0.05 rad at 1 Hz about the
pose. Only contacts with the ground are computed, or with `--self-collision` the robot's with itself too, and with
`--dry-friction` every joint has the dry friction of `benches/step.rs` in both engines. The engines are measured in turns;
timings are the best of every step of many rounds, of MuJoCo without what a call from Python takes and of gaitwright without
a look at the clock. Contacts, residual and penetration come from a round that is not timed.
"""

import argparse
import json
import math
import os
import pathlib
import re
import subprocess
import time

import mujoco
import numpy as np

import robot

STEPS = 1000
STEP = 0.002


# Of `benches/step.rs`, N m.
DRY_FRICTION = 0.15


def ours(urdf, way):
    """Steps a second of `cargo bench --bench step`, solved in this `way`, and the line that says it."""
    command = ["cargo", "bench", "--bench", "step", "--", way]
    root = pathlib.Path(__file__).resolve().parents[2]
    environment = os.environ | {"ROBOT": os.path.abspath(urdf)}
    bench = subprocess.run(command, cwd=root, env=environment, check=True, stdout=subprocess.PIPE, text=True)
    if way == "dry-friction":
        line = re.search(r"^dry-friction, sways: .* \((\d+) ns, .*$", bench.stdout, re.MULTILINE)
        return 1e9 / int(line[1]), line[0]
    line = re.search(rf"^{way}: (\d+) steps/s.*$", bench.stdout, re.MULTILINE)
    return int(line[1]), line[0]


def theirs(model, data, targets, start, best):
    """One round of MuJoCo, which lowers the `best` seconds of each step: a step is too short to be interrupted often."""

    def timed(*arguments):
        started = time.perf_counter()
        mujoco.mj_step(model, data, *arguments)
        return time.perf_counter() - started

    # What a timed call from Python takes without any step is not MuJoCo's.
    call = min(timed(0) for _ in range(100))
    robot.place(model, data, *start)
    for index, target in enumerate(targets):
        data.ctrl[:] = target
        best[index] = min(best[index], timed() - call)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("urdf")
    parser.add_argument("--check", help="output of `gaitwright check`, for its standing pose and height")
    parser.add_argument("--stiffness", type=float, default=60.0)
    parser.add_argument("--damping", type=float, default=2.0)
    parser.add_argument("--rounds", type=int, default=300, help="rounds of MuJoCo in each turn")
    parser.add_argument("--turns", type=int, default=4)
    either = parser.add_mutually_exclusive_group()
    either.add_argument("--self-collision", action="store_true", help="let the robot touch itself, in both engines")
    either.add_argument("--dry-friction", action="store_true", help="dry friction in all joints, in both engines")
    options = parser.parse_args()
    model = robot.load(options.urdf, (options.stiffness, options.damping, None), itself=options.self_collision)
    model.opt.timestep = STEP
    way = "self-collision" if options.self_collision else "newton"
    if options.dry_friction:
        way, model.dof_frictionloss[6:] = "dry-friction", DRY_FRICTION
    data = mujoco.MjData(model)
    pose, height = {}, 0.35
    if options.check:
        standing = json.load(open(options.check))["standing"]
        pose, height = standing["joints"], standing["root_height"]
    rest = np.array([pose.get(name, 0.0) for name in robot.joints(model)])
    sways = np.array([index % 3 != 0 for index in range(model.nu)], dtype=float)
    targets = [rest + 0.05 * math.sin(2 * math.pi * index * STEP) * sways for index in range(STEPS)]

    each, fastest, line = [math.inf] * STEPS, 0, ""
    for _ in range(options.turns):
        for _ in range(options.rounds):
            theirs(model, data, targets, (pose, height), each)
        steps, said = ours(options.urdf, way)
        if steps > fastest:
            fastest, line = steps, said

    best = sum(each)
    robot.place(model, data, pose, height)
    contacts, solver, law, depth = 0, 0.0, [], 0.0
    for target in targets:
        data.ctrl[:] = target
        mujoco.mj_step(model, data)
        contacts += data.ncon
        solver = max(solver, robot.solver_residual(model, data))
        law.append(robot.contact_residual(model, data))
        depth = max(depth, robot.depth(data))
    print(
        f"mujoco {mujoco.__version__}: {STEPS / best:.0f} steps/s, {contacts / STEPS:.2f} contacts, {model.nv} degrees of "
        f"freedom, mass {sum(model.body_mass):.3f} kg, root at {data.qpos[2]:.3f} m in the end\n"
        f"residual of its own problem at most {solver:.1e} m/s, of rigid contact with friction median "
        f"{np.median(law):.1e} and at most {max(law):.1e} m/s, penetration at most {depth:.1e} m\n"
        f"gaitwright, {line}: {fastest * best / STEPS:.2f} times as many"
    )


if __name__ == "__main__":
    main()
