// The learning curve: best and mean fitness by generation, with axes, gait after gait.

import { digits, make, svg, words } from "./dom.js";

const HEIGHT = 260;
const MARGIN = { left: 58, right: 14, top: 30, bottom: 42 };

/** An empty figure of a curve; `add` a generation's figures to it as they come. */
export class Curve {
  constructor() {
    /** The stretches in which one gait was searched for. */
    this.parts = [];
    /** Figures of the last generation that was added. */
    this.newest = null;
    // The least and the greatest fitness to be seen.
    [this.low, this.high] = [0, 0.1];
    this.drawing = svg("svg", { class: "curve", role: "img" });
    this.element = make("figure", { class: "curve-figure" }, this.drawing,
      make("figcaption", {}, make("span", { class: "key best" }, "best so far"), make("span", { class: "key mean" }, "mean of the generation")));
    // Drawn anew for every width, so that its letters keep their size.
    this.width = 640;
    new ResizeObserver(([{ contentRect }]) => {
      if (contentRect.width === 0 || contentRect.width === this.width) return;
      this.width = contentRect.width;
      this.drawSoon();
    }).observe(this.element);
    this.draw();
  }

  /** Generations come in their order; those that come again are passed over. */
  add(figures) {
    const { generation, gait = null, best, mean } = figures;
    if (generation <= this.newest?.generation) return;
    this.newest = figures;
    // What falls at once counts as little as what is not there.
    for (const value of [best, mean].filter((value) => value > -1)) {
      this.low = Math.min(this.low, value);
      this.high = Math.max(this.high, value);
    }
    const part = this.parts.at(-1);
    if (part) part.to = generation;
    if (part?.gait === gait) part.own.push(figures);
    else this.parts.push({ gait, from: generation, to: generation, own: [figures] });
    this.drawSoon();
  }

  drawSoon() {
    this.waiting ??= requestAnimationFrame(() => {
      this.waiting = null;
      this.draw();
    });
  }

  draw() {
    const { parts, newest, width } = this;
    this.drawing.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    const last = Math.max(newest?.generation ?? 0, 10);
    const bottom = this.low;
    const top = this.high * 1.05;
    const x = (generation) => MARGIN.left + ((width - MARGIN.left - MARGIN.right) * generation) / last;
    const y = (value) => HEIGHT - MARGIN.bottom - ((HEIGHT - MARGIN.top - MARGIN.bottom) * (Math.max(value, bottom) - bottom)) / (top - bottom);
    const text = (at, string, anchor = "middle", name = "tick") => svg("text", { x: at[0], y: at[1], "text-anchor": anchor, class: name }, string);
    const rows = ticks(bottom, top, 4).map((value) => [
      svg("line", { x1: MARGIN.left, x2: width - MARGIN.right, y1: y(value), y2: y(value), class: "grid" }),
      text([MARGIN.left - 8, y(value) + 4], String(Number(value.toPrecision(3))), "end")]);
    const columns = ticks(0, last, 6).map((value) => text([x(value), HEIGHT - MARGIN.bottom + 18], String(value)));
    const bands = parts.map(({ gait, from, to }, at) => [
      svg("rect", { x: x(from), y: MARGIN.top, width: Math.max(x(to) - x(from), 1), height: HEIGHT - MARGIN.top - MARGIN.bottom, class: at % 2 ? "band odd" : "band" }),
      gait && x(to) - x(from) > 40 && text([(x(from) + x(to)) / 2, MARGIN.top - 8], words(gait), "middle", "band-name")]);
    const lines = parts.flatMap(({ from, to, own }) => ["mean", "best"].map((key) =>
      svg("polyline", { class: `line ${key}`, points: thinned(own, key, x(to) - x(from)).map((point) => `${x(point.generation)},${y(point[key])}`).join(" ") })));
    this.drawing.replaceChildren(...[bands, rows, columns].flat(2).filter(Boolean),
      text([(MARGIN.left + width - MARGIN.right) / 2, HEIGHT - 4], "generation", "middle", "axis-name"),
      svg("text", { x: 0, y: 0, "text-anchor": "middle", class: "axis-name", transform: `translate(12 ${(HEIGHT - 10) / 2}) rotate(-90)` }, "fitness"),
      ...lines);
    this.drawing.setAttribute("aria-label", newest
      ? `Learning curve: after ${newest.generation + 1} generations the best ${newest.gait ?? "motion"} has fitness ${digits(newest.best)}`
      : "Learning curve, empty so far");
  }
}

/** As many of the points as `pixels` can show: of those that would share a pixel, the lowest and the highest. */
function thinned(points, key, pixels) {
  const share = Math.ceil(points.length / Math.max(pixels, 1));
  if (share <= 2) return points;
  const kept = [];
  for (let from = 0; from < points.length; from += share) {
    const own = points.slice(from, from + share);
    const lowest = own.reduce((low, point) => (point[key] < low[key] ? point : low));
    const highest = own.reduce((high, point) => (point[key] > high[key] ? point : high));
    kept.push(...(lowest.generation < highest.generation ? [lowest, highest] : [highest, lowest]));
  }
  return kept;
}

/** Round numbers from `low` to `high`, about so many. */
function ticks(low, high, about) {
  const rough = (high - low) / about;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= rough) * power;
  const found = [];
  for (let value = Math.ceil(low / step) * step; value <= high + step * 1e-6; value += step) found.push(Number(value.toPrecision(12)));
  return found;
}
