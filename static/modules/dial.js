// The direction of travel: an arrow seen from above, dragged or turned by keys.

import { make, svg } from "./dom.js";

const STEP = 5;

/** The dial; `changed` is told the direction, degrees to the left of where the character looks. */
export function directionDial(changed) {
  let degrees = 0;
  const arrow = svg("g", {}, svg("path", { d: "M0 8V-26M-8-18 0-30l8 12", class: "dial-arrow" }));
  const body = svg("path", { d: "M-6 12h12V-8q-6-8-12 0z", class: "dial-body" });
  const ticks = Array.from({ length: 24 }, (_, at) =>
    svg("line", { x1: 0, x2: 0, y1: -40, y2: at % 6 ? -37 : -34, transform: `rotate(${at * 15})`, class: "dial-tick" }));
  const dial = svg("svg", {
    viewBox: "-44 -44 88 88", class: "dial", tabindex: 0, role: "slider",
    "aria-label": "Direction of travel", "aria-valuemin": -180, "aria-valuemax": 180,
  }, svg("circle", { r: 42, class: "dial-face" }), ...ticks, body, arrow);
  const text = make("output", { class: "dial-text" });

  function set(value) {
    degrees = ((((value + 180) % 360) + 360) % 360) - 180;
    arrow.setAttribute("transform", `rotate(${-degrees})`);
    dial.setAttribute("aria-valuenow", degrees);
    dial.setAttribute("aria-valuetext", name(degrees));
    text.textContent = name(degrees);
    changed?.(degrees);
  }

  function point(event) {
    const { left, top, width, height } = dial.getBoundingClientRect();
    const [x, y] = [event.clientX - left - width / 2, event.clientY - top - height / 2];
    if (Math.hypot(x, y) < 4) return;
    set(Math.round((Math.atan2(-x, -y) * 180) / Math.PI / STEP) * STEP);
  }

  dial.addEventListener("pointerdown", (event) => {
    dial.setPointerCapture(event.pointerId);
    point(event);
  });
  dial.addEventListener("pointermove", (event) => dial.hasPointerCapture(event.pointerId) && point(event));
  dial.addEventListener("keydown", (event) => {
    const turned = { ArrowLeft: STEP, ArrowUp: STEP, ArrowRight: -STEP, ArrowDown: -STEP, PageUp: 45, PageDown: -45 }[event.key];
    if (turned) set(degrees + turned);
    else if (event.key === "Home") set(0);
    else return;
    event.preventDefault();
  });
  set(0);
  return {
    element: make("div", { class: "dial-box" }, dial, text),
    set,
    /** The direction as a task has it. */
    vector() {
      const angle = (degrees * Math.PI) / 180;
      return [Math.cos(angle), Math.sin(angle), 0].map((part) => Number(part.toFixed(6)));
    },
    /** Takes the direction of a task. */
    setVector([x, y]) {
      set(Math.round((Math.atan2(y, x) * 180) / Math.PI));
    },
  };
}

function name(degrees) {
  if (degrees === 0) return "straight ahead";
  if (Math.abs(degrees) === 180) return "backwards";
  return `${Math.abs(degrees)}° to the ${degrees > 0 ? "left" : "right"}`;
}
