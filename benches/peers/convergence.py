"""How far motions get at smaller and smaller steps, with each kind of feedforward: a table in Markdown and a plot.

    python benches/peers/convergence.py examples/quadruped-walk.motion.json learned/motions/*.json \\
        --character examples/quadruped.urdf --gaitwright target/release/gaitwright --svg static/convergence.svg

Each motion is tracked on level ground. The last column is how far the distance changes at one of the steps if the weight
changes by a part in 10⁵: below that the steps cannot agree.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile

STEPS = [8, 4, 2, 1, 0.5, 0.25, 0.125]
FEEDFORWARDS = ["none", "contact_free", "contact_aware"]
COLORS = {"none": "#1f5fa0", "contact_free": "#c85f0f", "contact_aware": "#14825a"}
MARKERS = "osD^v"

GRAVITY = 9.81
# Weights that ought to make no difference, and the step at which they are tried, ms.
WEIGHTS = [1 + change for change in (-1e-5, -1e-6, 1e-6, 1e-5)]
SPREAD_STEP = 0.5


def distance(motion, character, feedforward, step, seconds, program, weight=1.0):
    """How far the root gets from its start over level ground with this multiple of its weight, m."""
    document = {
        "format": "gaitwright/scenario@1",
        "character": str(character.resolve()),
        "scene": {"gravity": [0, 0, -GRAVITY * weight]},
        "drive": {"kind": "track", "motion": str(motion.resolve()), "feedforward": feedforward},
        "duration": seconds,
        "sample_every": seconds,
    }
    with tempfile.TemporaryDirectory() as place:
        path = pathlib.Path(place) / "scenario.json"
        path.write_text(json.dumps(document))
        run = subprocess.run(
            [program, "simulate", path, "--step", str(step / 1000)], stdout=subprocess.PIPE, check=True
        )
    first, last, _ = (json.loads(line) for line in run.stdout.splitlines())
    (x0, y0, _), (x1, y1, _) = first["root"]["position"], last["root"]["position"]
    return ((x1 - x0) ** 2 + (y1 - y0) ** 2) ** 0.5


def draw(lines, spreads, path):
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "convergence", "font.size": 11})
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(9.6, 4.8), layout="constrained")
    names = list(dict.fromkeys(name for name, _ in lines))
    for (name, feedforward), distances in lines.items():
        finest = distances[-1]
        errors = [abs(far / finest - 1) for far in distances[:-1]]
        marker = MARKERS[names.index(name) % len(MARKERS)]
        label = f"{name}, {feedforward}"
        axes.loglog(STEPS[:-1], errors, color=COLORS[feedforward], marker=marker, linewidth=1.4, label=label)
        if spreads[name, feedforward] > min(errors):
            axes.axhline(spreads[name, feedforward], color=COLORS[feedforward], linewidth=0.8, linestyle="--")
            axes.plot(STEPS[0], spreads[name, feedforward], color=COLORS[feedforward], marker=marker, fillstyle="none")
    slope = [0.01 * step for step in STEPS[:-1]]
    axes.loglog(STEPS[:-1], slope, color="#888888", linestyle=":", label="first order")
    axes.set_title(f"Distance covered: difference from that at {STEPS[-1]} ms", loc="left")
    axes.set_xticks(STEPS[:-1], [f"{step:g}" for step in STEPS[:-1]])
    axes.minorticks_off()
    axes.set_xlabel("step, ms")
    axes.set_ylabel("relative difference")
    axes.grid(True, which="major", color="#dddddd")
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside right upper", frameon=False)
    figure.savefig(path, metadata={"Date": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("motions", nargs="+", type=pathlib.Path, help="motion documents")
    parser.add_argument("--character", required=True, type=pathlib.Path, help="whose motions they are")
    parser.add_argument("--gaitwright", required=True, type=pathlib.Path, help="the program")
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--svg", type=pathlib.Path, help="the plot")
    options = parser.parse_args()
    program = options.gaitwright.resolve()
    print(f"| distance in {options.seconds:g} s, m; step, ms | " + " | ".join(f"{step:g}" for step in STEPS) + " | spread |")
    print("|---" * (2 + len(STEPS)) + "|")
    lines, spreads = {}, {}
    for motion in options.motions:
        name = motion.name.removesuffix(".json").removesuffix(".motion")
        for feedforward in FEEDFORWARDS:
            key = (name, feedforward)
            scene = (motion, options.character, feedforward)
            lines[key] = [distance(*scene, step, options.seconds, program) for step in STEPS]
            others = [distance(*scene, SPREAD_STEP, options.seconds, program, weight) for weight in WEIGHTS]
            present = lines[key][STEPS.index(SPREAD_STEP)]
            spreads[key] = max(abs(far / present - 1) for far in others)
            distances = " | ".join(f"{far:.3f}" for far in lines[key])
            print(f"| {name}, `{feedforward}` | {distances} | {spreads[key]:.0e} |", flush=True)
    if options.svg:
        draw(lines, spreads, options.svg)


if __name__ == "__main__":
    main()
