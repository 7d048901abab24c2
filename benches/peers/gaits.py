"""The gaits of characters, learned one by one: what each costs, how often it is natural, and what is left of it elsewhere.

    pip install mujoco
    python benches/peers/gaits.py examples/quadruped.urdf path/to/a1.urdf --seeds 5 --out gaits

Trains every case on every character with every seed, as `gaitwright train` does for a job that asks for that gait at that Froude
number and for nothing else (but for more time, where `--budget` says so), plays what comes out in MuJoCo, and prints a table a character: medians over the seeds, with the least and
the greatest. What is in the folder already is not trained again. `--gaits repertoire` trains the whole repertoire of jobs
that ask for nothing, and prints a row a motion.
"""

import argparse
import json
import pathlib
import re
import statistics
import subprocess
import tempfile
import time

import transfer

QUADRUPED = ["walk:0.1", "trot:0.4", "trot:1", "canter:1", "bound:1", "gallop:2"]
CONTACTS = [0.02, 0.01, 0.005]


def train(options, robot, case, seed):
    """Folder of the training's files, and how long it took, s; `None` where that is not known."""
    folder = options.out / pathlib.Path(robot).stem / f"{case.replace(':', '-')}-{seed}"
    if (folder / "report.json").exists():
        seconds = folder / "seconds"
        return folder, float(seconds.read_text()) if seconds.exists() else None
    folder.mkdir(parents=True, exist_ok=True)
    command = [options.gaitwright, "train", robot, "--out", str(folder), "--seed", str(seed)]
    document = {"learning": {"seconds": options.budget}} if options.budget else {}
    if case != "repertoire":
        gait, froude = case.split(":")
        document["task"] = {"gait": gait, "froude": float(froude), "direction": [*options.direction, 0]}
    if document:
        job = folder / "job.json"
        job.write_text(json.dumps(document))
        command += ["--job", str(job)]
    begun = time.monotonic()
    with open(folder / "log", "w") as log:
        status = subprocess.run(command, stdout=log, stderr=log, check=False).returncode
    seconds = time.monotonic() - begun
    # A training that finds no motion, with status 1, is a result; a refusal is not, and the reason stands at the end of the log.
    if status not in (0, 1):
        lines = (folder / "log").read_text().strip().splitlines()
        raise SystemExit(f"{robot}, {case}, seed {seed}: {lines[-1] if lines else f'status {status}'}")
    (folder / "seconds").write_text(str(seconds))
    return folder, seconds


def first_natural(folder):
    """How long it took from the start of the learning to the first natural motion on the way, s; `None` where none came before the end."""
    found = re.search(r"^.* after (\d+) s: .*, natural$", (folder / "log").read_text(), re.MULTILINE)
    return float(found[1]) if found else None


def read_by_mujoco(robot):
    """Whether MuJoCo reads the description itself: a URDF whose collision shapes are no meshes, which it looks for elsewhere and
    not in every format. Others go by way of their exported models."""
    path = pathlib.Path(robot)
    return path.suffix == ".urdf" and not re.search(r"<collision\b(?:(?!</collision>).)*<mesh", path.read_text(), re.DOTALL)


def played(options, robot, motion, path):
    """Speed over ours, change of heading and time upright in MuJoCo, for each contact."""
    known = path.with_suffix(f".mujoco-{options.seconds:g}s")
    if known.exists():
        return json.loads(known.read_text())
    with tempfile.TemporaryDirectory() as folder:
        if not read_by_mujoco(robot):
            model = str(pathlib.Path(folder) / "model.xml")
            export = [options.gaitwright, "export", str(path), "--character", robot, "--format", "mujoco", "--out", model]
            subprocess.run(export, check=True, stdout=subprocess.DEVNULL)
            robot = model
        outcomes = []
        for contact in CONTACTS:
            step = min(transfer.STEP, contact / 4)
            speed, turn, upright = transfer.play(robot, motion, options.seconds, contact, step)
            outcomes.append([speed / motion["metrics"]["speed"], turn, upright])
    known.write_text(json.dumps(outcomes))
    return outcomes


def kept(trial):
    """Whether a motion stayed upright in a trial and kept its speed to within the tolerance."""
    share = trial["relative_speed"]
    return trial["upright_seconds"] >= 0.99 * trial["of_seconds"] and share is not None and abs(share - 1) <= trial.get("tolerance", 0.2)


def spread(values, form):
    values = [value for value in values if value is not None]
    if not values:
        return "–"
    middle, least, most = statistics.median(values), min(values), max(values)
    texts = [form.format(value) for value in (middle, least, most)]
    return texts[0] if texts[1] == texts[2] else f"{texts[0]} ({texts[1]} to {texts[2]})"


def row(found, seconds, firsts, length):
    """A column of the table: the figures of one case over its seeds. `found` are pairs of a motion and its outcomes in MuJoCo,
    `seconds` the times of all trainings, also of those that found no motion, `firsts` those to the first natural motion, `length` how long MuJoCo played, s."""
    metrics = [motion["metrics"] for motion, _ in found]
    natural = [one for one in metrics if one["natural"]]
    trials = [one["validity"]["trials"] for one in metrics]
    at = lambda words: [
        abs(trial["relative_speed"] - 1)
        for some in trials
        for trial in some
        if trial["change"].startswith(words) and trial["relative_speed"] is not None
    ]
    held = sum(all(map(kept, some)) for some in trials)
    broken = sorted({name for one in metrics for name, measure in one["naturalness"].items() if not measure["holds"]})
    cells = {
        "natural": f"{len(natural)} of {len(seconds)}",
        "speed, m/s": spread([one["speed"] for one in metrics], "{:.2f}"),
        "cost of transport": spread([one["cost_of_transport"] for one in metrics], "{:.2f}"),
        "stride time, s": spread([one["stride_period"] for one in metrics], "{:.2f}"),
        "duty factor": spread([statistics.mean(one["duty_factors"].values()) for one in metrics], "{:.2f}"),
        "all trials kept": f"{held} of {len(seconds)}",
        "change of speed at ¼ and twice the step, at most": f"{100 * max(at('step of'), default=0):.1f} %",
        "training, s": spread(seconds, "{:.1f}"),
        "of these to the first natural motion": spread(firsts, "{:.0f}"),
    }
    for index, contact in enumerate(CONTACTS):
        outcomes = [outcome[index] for _, outcome in found]
        upright = [outcome for outcome in outcomes if outcome[2] > 0.99 * length]
        text = spread([100 * (outcome[0] - 1) for outcome in upright], "{:+.0f}") + " %" if upright else "–"
        fallen = len(outcomes) - len(upright)
        turned = max((abs(outcome[1]) for outcome in upright), default=0)
        cells[f"MuJoCo, {1000 * contact:g} ms: speed"] = text + (f", {fallen} fall" if fallen else "")
        cells[f"MuJoCo, {1000 * contact:g} ms: turn in {length:g} s, at most"] = f"{turned:.2f} rad"
    cells["missed"] = ", ".join(broken) or "–"
    return cells


def table(columns):
    names = list(columns)
    print("| | " + " | ".join(names) + " |\n|" + "---|" * (len(names) + 1))
    for label in next(iter(columns.values())):
        print(f"| {label} | " + " | ".join(columns[name][label] for name in names) + " |")
    print(flush=True)


def repertoire(options, robot, seed):
    folder, seconds = train(options, robot, "repertoire", seed)
    print(f"\n{pathlib.Path(robot).stem}, seed {seed}" + (f", {seconds:.0f} s" if seconds else ""), end="\n\n")
    print("| motion | gait | natural | speed | cost of transport | trials kept | " + " | ".join(f"{1000 * it:g} ms" for it in CONTACTS) + " |")
    print("|" + "---|" * (6 + len(CONTACTS)))
    for entry in json.loads((folder / "motions.json").read_text())["motions"]:
        path = folder / "motions" / entry["file"]
        motion = json.loads(path.read_text())
        metrics = motion["metrics"]
        trials = metrics["validity"]["trials"]
        held = sum(map(kept, trials))
        broken = ", ".join(name for name, measure in metrics["naturalness"].items() if not measure["holds"])
        cells = [
            entry["name"] + (", steered" if motion.get("steering") else ""),
            metrics["gait"] or "–",
            "yes" if metrics["natural"] else f"no: {broken}",
            f"{metrics['speed']:.2f} m/s",
            f"{metrics['cost_of_transport'] or 0:.2f}",
            f"{held} of {len(trials)}",
        ]
        for share, turn, upright in played(options, robot, motion, path):
            text = f"{100 * (share - 1):+.0f} %" + (f", turns {abs(turn):.1f} rad" if abs(turn) > 0.2 else "")
            cells.append(text if upright > 0.99 * options.seconds else f"falls after {upright:.1f} s")
        print("| " + " | ".join(cells) + " |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("robots", nargs="+", help="URDF or character JSON")
    parser.add_argument("--gaits", nargs="+", default=QUADRUPED, help="cases as gait:Froude, or `repertoire`")
    parser.add_argument("--direction", type=float, nargs=2, default=[1, 0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=1, help="the first seed")
    parser.add_argument("--seconds", type=float, default=10.0, help="played in MuJoCo, s")
    parser.add_argument("--budget", type=float, help="of a job, s: on a slow machine more than the usual, so that no search is cut short")
    parser.add_argument("--gaitwright", default="target/release/gaitwright")
    parser.add_argument("--out", type=pathlib.Path, required=True)
    options = parser.parse_args()
    seeds = range(options.first, options.first + options.seeds)
    for robot in options.robots:
        if options.gaits == ["repertoire"]:
            for seed in seeds:
                repertoire(options, robot, seed)
            continue
        columns = {}
        for case in options.gaits:
            found, times, firsts = [], [], []
            for seed in seeds:
                folder, seconds = train(options, robot, case, seed)
                times.append(seconds)
                firsts.append(first_natural(folder))
                path = folder / "motion.json"
                if path.exists():
                    motion = json.loads(path.read_text())
                    found.append((motion, played(options, robot, motion, path)))
            if found:
                gait, froude = case.split(":")
                columns[f"{gait}, Fr {froude}"] = row(found, times, firsts, options.seconds)
        print(f"\n{pathlib.Path(robot).stem}", end="\n\n")
        if columns:
            table(columns)


if __name__ == "__main__":
    main()
