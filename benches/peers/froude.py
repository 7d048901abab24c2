"""Which gait costs least at which speed: a plot of what the bench of natural gaits has printed.

    CASES="any:0.05 any:0.1 any:0.3 any:0.6 any:1 any:2" cargo bench -p gaitwright-learning --bench natural > sweep.txt
    python benches/peers/froude.py sweep.txt --svg static/froude.svg

Asked for a speed and for no gait, a job tries the gaits that animals use there. Prints, for each Froude number asked for,
those that came out natural, the cheapest first. Behind the points of the plot stand the Froude numbers at which horses and
dogs change from walk to trot and from trot to gallop (Alexander & Jayes 1983).
"""

import argparse
import re

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
    found = []
    for line in open(path):
        match = LINE.match(line)
        if match:
            speed, asked = float(match["speed"]), float(match["asked"])
            froude = float(match["froude"]) * (asked / speed) ** 2 if speed else 0.0
            found.append((match["name"], asked, froude, float(match["cost"]), match["verdict"] == "natural"))
    return found


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
    axes.set_ylim(bottom=0)
    axes.set_xlabel("Froude number asked for")
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
    print("| asked, m/s | natural, the cheapest first (cost of transport) | not natural |")
    print("|---|---|---|")
    for asked in sorted({asked for _, asked, *_ in found}):
        here = sorted((cost, name, natural) for name, speed, _, cost, natural in found if speed == asked)
        told = [", ".join(f"{name} ({cost:.2f})" for cost, name, holds in here if holds == kept) for kept in (True, False)]
        print(f"| {asked:.2f} | {told[0] or '–'} | {told[1] or '–'} |")
    if options.svg:
        draw(found, options.svg)


if __name__ == "__main__":
    main()
