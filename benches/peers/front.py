"""Error against computing time of gaitwright, rapier3d and MuJoCo on one scenario: a table and a plot.

    pip install mujoco matplotlib
    python benches/peers/front.py examples/quadruped-walk.json --gaitwright target/release/gaitwright \\
        --out front --svg static/front-walk.svg

gaitwright and rapier3d are measured by `gaitwright accuracy`, MuJoCo by `work_precision.py`, in turns, so that what else
the machine does falls on all of them; the least time of all rounds counts. Before that, both engines simulate the scenario
without ground at fine steps, where they must agree if it is the same robot, start, servos and targets: by how
much they do not is printed. After it, the times that the engines take for the same error.
"""

import argparse
import csv
import json
import math
import pathlib
import subprocess
import tempfile

import numpy as np

import work_precision

METHODS = [
    "semi-implicit Euler",
    "Moreau-Jean",
    "Moreau-Jean, error control",
    "rapier",
]
# What is drawn how: gaitwright in blue, MuJoCo in red, rapier3d in grey.
LOOKS = {
    ("gaitwright", "semi-implicit Euler"): ("#7fb2e5", "o"),
    ("gaitwright", "Moreau-Jean"): ("#1f5fa0", "s"),
    ("gaitwright", "Moreau-Jean, error control"): ("#0b2545", "D"),
    ("MuJoCo", "Euler"): ("#f2a07b", "o"),
    ("MuJoCo", "implicitfast"): ("#c85f0f", "s"),
    ("MuJoCo", "RK4"): ("#8c1d18", "D"),
    ("rapier3d", "rapier"): ("#888888", "^"),
}
# Fine steps of the comparison of the engines with each other, s.
AGREEING = {"gaitwright": 1e-5, "MuJoCo": 1e-4}


def own_rows(scenario, gaitwright, out):
    """Rows of gaitwright's table, in the columns that are shared, and its truth."""
    command = [gaitwright, "accuracy", scenario, "--out", out]
    subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=True)
    rows = []
    for row in csv.DictReader(open(out / "table.csv")):
        if row["method"] in METHODS and row["status"] != "left_out":
            engine = "rapier3d" if row["engine"] == "rapier" else row["engine"]
            shared = {key: float(row[key] or "nan") for key in ("step", "step_tolerance", "error", "seconds")}
            kept = {"scene": scenario.name, "engine": engine, "method": row["method"], "status": row["status"]}
            rows.append(kept | shared)
    return rows, json.load(open(out / "table.json"))["truth"]


def name(row):
    return row["engine"].split()[0], row["method"]


def fastest(rounds):
    """The rows of several rounds as one, with the least time of each."""
    least = {}
    for row in (row for rows in rounds for row in rows):
        key = (*name(row), row["step"])
        if key not in least or row["seconds"] < least[key]["seconds"]:
            least[key] = row
    return list(least.values())


def curves(rows):
    """Errors and times of each method's measured rows, the longest step first."""
    lines = {}
    for row in sorted(rows, key=lambda row: -row["step"]):
        if row["status"] == "measured":
            lines.setdefault(name(row), []).append((row["error"], row["seconds"]))
    return lines


def seconds_for(lines, engine, error):
    """The least time in which a method of `engine` has this error, between its own points, and which one; or None."""
    found = []
    for (own, method), points in lines.items():
        if own != engine:
            continue
        errors, seconds = np.log(sorted(points)).T
        # Beyond the largest error of a method, its longest step serves as well.
        if errors[0] <= math.log(error):
            found.append((math.exp(np.interp(math.log(error), errors, seconds)), method))
    return min(found, default=None)


def compare(lines):
    """Prints what the same error takes."""
    print(f"{'error, m':>9}  {'gaitwright, s/s':>15}  {'MuJoCo, s/s':>11}  {'ratio':>5}  {'rapier3d, s/s':>13}  by")
    for tenths in range(-4, -22, -1):
        error = 10 ** (tenths / 2)
        ours, peer, rapier = (seconds_for(lines, engine, error) for engine in ("gaitwright", "MuJoCo", "rapier3d"))
        if ours and peer:
            other = f"{rapier[0]:13.2e}" if rapier else f"{'':13}"
            ratio = peer[0] / ours[0]
            print(f"{error:9.1e}  {ours[0]:15.2e}  {peer[0]:11.2e}  {ratio:5.2f}  {other}  {ours[1]}; {peer[1]}")


def draw(scenario, lines, path):
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "front", "font.size": 11})
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(9.6, 5.4), layout="constrained")
    for key, (color, marker) in LOOKS.items():
        if key in lines:
            errors, seconds = zip(*lines[key])
            label = "rapier3d" if key[0] == "rapier3d" else " ".join(key)
            axes.loglog(seconds, errors, color=color, marker=marker, markersize=5, linewidth=1.6, label=label)
    axes.set_title(f"{scenario.name}: error against computing time", loc="left")
    axes.set_xlabel("computing time for a simulated second, s")
    axes.set_ylabel("error, m")
    axes.grid(True, which="major", color="#dddddd")
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside right upper", frameon=False)
    figure.savefig(path, metadata={"Date": None})


def agreement(scenario, gaitwright):
    """Greatest difference of both engines in root position, m, and joint angle, rad, without ground."""
    document = json.loads(scenario.read_text())
    folder = scenario.parent.resolve()
    document["character"] = str(folder / document["character"])
    if "motion" in document.get("drive", {}):
        document["drive"]["motion"] = str(folder / document["drive"]["motion"])
    document.setdefault("scene", {})["ground"] = None
    document["duration"] = document["sample_every"] = 0.5
    document["accuracy"] = {"step": AGREEING["gaitwright"], "integrator": "moreau_jean"}
    with tempfile.TemporaryDirectory() as place:
        path = pathlib.Path(place) / "flying.json"
        path.write_text(json.dumps(document))
        run = subprocess.run([gaitwright, "simulate", path], stdout=subprocess.PIPE, check=True)
        scene = work_precision.Scene(path, gaitwright)
    end = json.loads(run.stdout.splitlines()[1])
    scene.choose("RK4", exact=True)
    step = AGREEING["MuJoCo"]
    count = round(document["duration"] / step)
    scene.run(step, count, scene.controls(0.0, step, count))
    root = np.abs(scene.data.qpos[:3] - end["root"]["position"]).max()
    joints = [
        abs(scene.data.qpos[scene.model.joint(name).qposadr[0]] - joint["angle"])
        for name, joint in end["joints"].items()
    ]
    return root, max(joints)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenario", type=pathlib.Path)
    parser.add_argument("--gaitwright", required=True, type=pathlib.Path, help="the program")
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder for front.csv and gaitwright's tables")
    parser.add_argument("--svg", type=pathlib.Path, help="the plot; front.svg in the folder where left out")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    program = options.gaitwright.resolve()

    root, joints = agreement(options.scenario, program)
    print(f"without ground the engines agree after 0.5 s to {root:.1e} m and {joints:.1e} rad")
    scene = work_precision.Scene(options.scenario, program)
    pieces, uncertainty = work_precision.reference(scene)
    rounds = []
    for _ in range(options.rounds):
        own, truth = own_rows(options.scenario, program, options.out / "gaitwright")
        rounds += [own, list(work_precision.rows(scene, pieces, options.repeats))]
    print(f"references are certain to {truth['uncertainty']:.1e} m (gaitwright) and {uncertainty:.1e} m (MuJoCo)")
    rows = fastest(rounds)
    work_precision.write(rows, options.out / "front.csv")
    lines = curves(rows)
    compare(lines)
    draw(options.scenario, lines, options.svg or options.out / "front.svg")


if __name__ == "__main__":
    main()
