"""Which gait costs least at which speed: a plot of what the bench of natural gaits has printed.

    CASES="any:0.05 any:0.1 any:0.3 any:0.6 any:1 any:2" cargo bench -p gaitwright-learning --bench natural > sweep.txt
    python benches/peers/froude.py sweep.txt --svg static/froude.svg

Asked for a speed and for no gait, a job tries the gaits that animals use there. Prints, for each Froude number asked for,
how many of each came out natural and the median cost of transport of these, the cheapest first. Behind the points of the plot stand the Froude numbers at which horses and
dogs change from walk to trot and from trot to gallop (Alexander & Jayes 1983).
"""

import argparse
import re
import statistics

COLORS = {
    "walk": "#1f5fa0",
    "trot": "#14825a",
    "running trot": "#0b4f37",
    "pace": "#8a6d1a",
    "canter": "#c85f0f",
    "bound": "#a02f5f",
    "transverse gallop": "#6b3fa0",
    "rotary gallop": "#3f3f70",
}
CHANGES = {"walk to trot": (0.35, 0.5), "trot to gallop": (2.0, 3.0)}
LINE = re.compile(
    r"(?P<name>.+?) seed \d+: (?P<speed>\S+) m/s of (?P<asked>\S+), Fr (?P<froude>\S+), CoT (?P<cost>\S+), "
    r"T \S+ s, (?P<gait>.+?), (?P<verdict>not natural|natural) "
)


def motions(path):
    """Name, Froude number asked for, cost of transport, and whether it is natural, of every line that is a motion."""
    lines = [match for match in map(LINE.match, open(path)) if match]
    # v² of Froude number 1, by the height of the hips in motion: the sums of many have more digits than what is printed of one.
    unit = sum(float(line["speed"]) ** 2 for line in lines) / sum(float(line["froude"]) for line in lines)
    return [
        (line["name"], asked, asked**2 / unit, float(line["cost"]), line["verdict"] == "natural")
        for line in lines
        for asked in [float(line["asked"])]
    ]


def draw(found, path):
    import matplotlib

    matplotlib.use("svg")
    matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "froude", "font.size": 11})
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(figsize=(9.6, 4.4), layout="constrained")
    for label, (least, most) in CHANGES.items():
        axes.axvspan(least, most, color="#eeeeee", linewidth=0)
        axes.text((least * most) ** 0.5, 0.98, label, transform=axes.get_xaxis_transform(), ha="center", va="top")
    for name in dict.fromkeys(name for name, *_ in found):
        for natural in (True, False):
            points = [(froude, cost) for other, _, froude, cost, holds in found if (other, holds) == (name, natural)]
            if points:
                color = COLORS.get(name, "#555555")
                axes.plot(
                    *zip(*points),
                    "o",
                    color=color,
                    markerfacecolor=color if natural else "none",
                    label=name if natural else f"{name}, not natural",
                )
    axes.set_xscale("log")
    axes.set_ylim(0, 1)
    axes.set_xlabel("Froude number of the speed asked for")
    axes.set_ylabel("cost of transport")
    axes.grid(True, color="#dddddd")
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside right upper", frameon=False)
    figure.savefig(path, metadata={"Date": None})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lines", help="what the bench has printed")
    parser.add_argument("--svg", help="the plot")
    options = parser.parse_args()
    found = motions(options.lines)
    print("| Froude number | speed, m/s | natural: cost of transport, seeds | not natural |")
    print("|---|---|---|---|")
    for asked in sorted({asked for _, asked, *_ in found}):
        here = [motion for motion in found if motion[1] == asked]
        natural, others = [], []
        for gait in dict.fromkeys(name for name, *_ in here):
            costs = [cost for name, _, _, cost, holds in here if name == gait and holds]
            count = sum(name == gait for name, *_ in here)
            if costs:
                natural.append((statistics.median(costs), f"{gait} {statistics.median(costs):.2f} ({len(costs)} of {count})"))
            else:
                others.append(gait)
        told = ", ".join(text for _, text in sorted(natural))
        print(f"| {here[0][2]:.1g} | {asked:.2f} | {told or '–'} | {', '.join(others) or '–'} |")
    if options.svg:
        draw(found, options.svg)


if __name__ == "__main__":
    main()
