// The footfall diagram of a gait: a row a foot, dark while it is on the ground, over two strides.

import { digits, make, svg } from "./dom.js";

const [WIDTH, ROW, LEFT] = [320, 18, 58];
const STRIDES = 2;

/** The diagram of a gait report, and the mark that shows where a player is. */
export function footfalls(report) {
  const feet = report.feet.filter((foot) => foot.phase !== null);
  const period = report.stride_period;
  if (!period || feet.length === 0) return null;
  const height = feet.length * ROW + 20;
  const x = (strides) => LEFT + ((WIDTH - LEFT - 4) * strides) / STRIDES;
  const rows = feet.map((foot, row) => {
    const y = row * ROW + 2;
    const bars = [];
    for (let stride = -1; stride < STRIDES; stride += 1) {
      const from = Math.max(stride + foot.phase, 0);
      const to = Math.min(stride + foot.phase + foot.duty_factor, STRIDES);
      if (to > from) bars.push(svg("rect", { x: x(from), y, width: x(to) - x(from), height: ROW - 5, rx: 3, class: "stance" }));
    }
    return [
      svg("text", { x: LEFT - 8, y: y + ROW - 7, "text-anchor": "end", class: "tick" }, foot.leg ?? foot.link.slice(0, 8)),
      svg("rect", { x: x(0), y, width: x(STRIDES) - x(0), height: ROW - 5, rx: 3, class: "swing" }), ...bars];
  });
  const said = feet.map((foot) => `${foot.leg ?? foot.link} touches down at ${digits(foot.phase)} and stands for ${digits(foot.duty_factor)} of the stride`);
  const drawing = svg("svg", { viewBox: `0 0 ${WIDTH} ${height}`, class: "footfalls", role: "img", "aria-label": `Footfalls: ${said.join("; ")}` },
    ...rows.flat(),
    svg("text", { x: x(0), y: height - 4, class: "tick" }, "0"),
    svg("text", { x: x(1), y: height - 4, "text-anchor": "middle", class: "tick" }, `${digits(period)} s`),
    svg("text", { x: x(STRIDES), y: height - 4, "text-anchor": "end", class: "tick" }, `${digits(2 * period)} s`));
  return make("div", { class: "footfalls-box" }, drawing);
}
