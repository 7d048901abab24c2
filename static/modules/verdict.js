// Why a motion is natural or not: every measure with its limit.

import { digits, make, short, words } from "./dom.js";

/** The measures that do not hold, the one farthest beyond its limit first. */
export function failing(naturalness) {
  const excess = ({ value, limit }) => {
    const [least, greatest] = Array.isArray(limit) ? limit : [null, limit];
    const beyond = greatest !== null && value > greatest ? value - greatest : least - value;
    return beyond / Math.max(Math.abs(greatest ?? 0), Math.abs(least ?? 0), 1e-9);
  };
  return Object.entries(naturalness)
    .map(([name, measure]) => ({ name, ...measure }))
    .filter((measure) => !measure.holds)
    .sort((a, b) => excess(b) - excess(a));
}

/** The verdict on a motion with all its figures. */
export function verdict(metrics) {
  const failed = failing(metrics.naturalness);
  const held = Object.entries(metrics.naturalness).filter(([, measure]) => measure.holds).map(([name, measure]) => ({ name, ...measure }));
  const total = failed.length + held.length;
  const sentence = metrics.natural
    ? `It moves as animals do: all ${total} measures hold.`
    : `${failed.length} of ${total} measures ${failed.length === 1 ? "does" : "do"} not hold.`;
  const validity = metrics.validity;
  const row = (measure) =>
    make("tr", { class: measure.holds ? "" : "fails" },
      make("th", { scope: "row" }, words(measure.name)),
      make("td", {}, short(measure.value)),
      make("td", {}, range(measure.limit)),
      make("td", { "aria-label": measure.holds ? "holds" : "does not hold" }, measure.holds ? "✓" : "✗"));
  return make("div", { class: "verdict-box" },
    make("p", { class: `verdict-line ${metrics.natural ? "good" : "bad"}` },
      make("strong", {}, metrics.natural ? "Natural" : "Not natural"), make("span", {}, sentence)),
    make("dl", { class: "facts tight" },
      ...Object.entries({
        Gait: metrics.gait ? words(metrics.gait) : "–",
        Speed: `${digits(metrics.speed)} m/s`,
        "Froude number": digits(metrics.froude),
        "Cost of transport": digits(metrics.cost_of_transport),
        Upright: `${digits(metrics.upright_seconds, 0)} s`,
        "Slip of the feet": `${digits(1000 * validity.foot_slip, 0)} mm/s`,
      }).map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value)))),
    failed.length > 0 && table("Measures that do not hold", failed.map(row)),
    make("details", {}, make("summary", {}, `The ${held.length} measures that hold`), table("Measures that hold", held.map(row))));
}

function table(label, rows) {
  const titles = ["Measure", "Value", "Limit", ""].map((title) => make("th", { scope: "col" }, title));
  return make("div", { class: "scroll", tabIndex: 0, role: "region", "aria-label": label },
    make("table", {}, make("thead", {}, make("tr", {}, titles)), make("tbody", {}, rows)));
}

function range(limit) {
  if (!Array.isArray(limit)) return `≤ ${short(limit)}`;
  const [least, greatest] = limit;
  if (least === null) return `≤ ${short(greatest)}`;
  if (greatest === null) return `≥ ${short(least)}`;
  return `${short(least)} – ${short(greatest)}`;
}
