// Elements, texts and numbers.

/** An element with properties (`class`, `aria-…` and `data-…` as attributes) and children; text is never taken for markup. */
export function make(tag, properties = {}, ...children) {
  return fill(document.createElement(tag), properties, children);
}

/** The same of the SVG namespace: every property is an attribute. */
export function svg(tag, attributes = {}, ...children) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children.filter((child) => child != null));
  return made;
}

function fill(made, properties, children) {
  for (const [name, value] of Object.entries(properties)) {
    if (value == null) continue;
    if (name === "class" || name === "role" || name === "for" || /^(aria|data)-/.test(name)) made.setAttribute(name, value);
    else if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else made[name] = value;
  }
  made.append(...children.flat().filter((child) => child != null && child !== false));
  return made;
}

/** A button that does `act`; `look` is its class. */
export function button(text, act, look = "button quiet") {
  return make("button", { type: "button", class: look, onclick: act }, text);
}

/** Says a sentence to readers of the screen. */
export function announce(sentence) {
  const announcer = document.getElementById("announcer");
  if (announcer.textContent !== sentence) announcer.textContent = sentence;
}

/** What went wrong, as an alert that takes the place of `slot`'s contents; `null` clears it. */
export function complain(slot, error) {
  if (!error) return slot.replaceChildren();
  const faults = error.faults ?? [];
  const list = faults.map(({ pointer, detail }) => make("li", {}, pointer && make("code", {}, pointer), pointer && " ", detail));
  slot.replaceChildren(
    make("div", { class: "alert", role: "alert" },
      make("strong", {}, error.title ?? "That did not work"),
      list.length ? make("ul", {}, list) : make("p", {}, error.message),
    ),
  );
}

/** A number with so many digits after the point; a dash where there is none. */
export function digits(value, count = 2) {
  return Number.isFinite(value) ? value.toFixed(count) : "–";
}

/** A number in as few signs as tell it. */
export function short(value) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 0.01 || size >= 10000)) return value.toExponential(1);
  return String(Number(value.toPrecision(3)));
}

/** A time in words: `45 s`, `3 min 20 s`. */
export function duration(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  const whole = Math.max(0, Math.round(seconds));
  if (whole < 60) return `${whole} s`;
  const [minutes, rest] = [Math.floor(whole / 60), whole % 60];
  if (minutes >= 60) return `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
  return rest ? `${minutes} min ${rest} s` : `${minutes} min`;
}

/** `one thing`, `2 things`. */
export function count(number, thing) {
  return `${number} ${thing}${number === 1 ? "" : "s"}`;
}

/** `snake_case` as words. */
export function words(name) {
  return name.replaceAll("_", " ");
}
