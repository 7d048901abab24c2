// The learning curve: best and mean fitness by generation, with axes, gait after gait.

import { digits, make, svg, words } from "./dom.js";

const HEIGHT = 260;
const MARGIN = { left: 58, right: 14, top: 30, bottom: 42 };

/** An empty figure of a curve; `add` a generation's figures to it as they come. */
export class Curve {
  constructor() {
    this.points = [];
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

  add(figures) {
    if (this.points.some((point) => point.generation === figures.generation)) return;
    this.points.push(figures);
    this.drawSoon();
  }

  drawSoon() {
    this.waiting ??= requestAnimationFrame(() => {
      this.waiting = null;
      this.draw();
    });
  }

  draw() {
    const { points, width } = this;
    this.drawing.setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
    const last = Math.max(points.at(-1)?.generation ?? 0, 10);
    // What falls at once counts as little as what is not there.
    const seen = points.flatMap((point) => [point.best, point.mean]).filter((value) => value > -1);
    const bottom = Math.min(0, ...seen);
    const top = Math.max(0.1, ...seen) * 1.05;
    const x = (generation) => MARGIN.left + ((width - MARGIN.left - MARGIN.right) * generation) / last;
    const y = (value) => HEIGHT - MARGIN.bottom - ((HEIGHT - MARGIN.top - MARGIN.bottom) * (Math.max(value, bottom) - bottom)) / (top - bottom);
    const text = (at, string, anchor = "middle", name = "tick") => svg("text", { x: at[0], y: at[1], "text-anchor": anchor, class: name }, string);
    const rows = ticks(bottom, top, 4).map((value) => [
      svg("line", { x1: MARGIN.left, x2: width - MARGIN.right, y1: y(value), y2: y(value), class: "grid" }),
      text([MARGIN.left - 8, y(value) + 4], String(Number(value.toPrecision(3))), "end")]);
    const columns = ticks(0, last, 6).map((value) => text([x(value), HEIGHT - MARGIN.bottom + 18], String(value)));
    const parts = gaits(points);
    const bands = parts.map(({ gait, from, to }, at) => [
      svg("rect", { x: x(from), y: MARGIN.top, width: Math.max(x(to) - x(from), 1), height: HEIGHT - MARGIN.top - MARGIN.bottom, class: at % 2 ? "band odd" : "band" }),
      gait && x(to) - x(from) > 40 && text([(x(from) + x(to)) / 2, MARGIN.top - 8], words(gait), "middle", "band-name")]);
    const lines = parts.flatMap(({ own }) => ["mean", "best"].map((key) =>
      svg("polyline", { class: `line ${key}`, points: own.map((point) => `${x(point.generation)},${y(point[key])}`).join(" ") })));
    this.drawing.replaceChildren(...[bands, rows, columns].flat(2).filter(Boolean),
      text([(MARGIN.left + width - MARGIN.right) / 2, HEIGHT - 4], "generation", "middle", "axis-name"),
      svg("text", { x: 0, y: 0, "text-anchor": "middle", class: "axis-name", transform: `translate(12 ${(HEIGHT - 10) / 2}) rotate(-90)` }, "fitness"),
      ...lines);
    const newest = points.at(-1);
    this.drawing.setAttribute("aria-label", newest
      ? `Learning curve: after ${newest.generation + 1} generations the best ${newest.gait ?? "motion"} has fitness ${digits(newest.best)}`
      : "Learning curve, empty so far");
  }
}

/** The stretches of a curve in which one gait was searched for. */
function gaits(points) {
  const parts = [];
  for (const point of points) {
    const part = parts.at(-1);
    if (part && part.gait === (point.gait ?? null)) {
      part.own.push(point);
      part.to = point.generation;
    } else {
      if (part) part.to = point.generation;
      parts.push({ gait: point.gait ?? null, from: point.generation, to: point.generation, own: [point] });
    }
  }
  return parts;
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
