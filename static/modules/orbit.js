// The eye of a view: it goes around what it looks at, by pointer, by keys and by buttons.

const STEP = Math.PI / 16;

export class Orbit {
  /** `element` takes the input; `changed` is called after every change. */
  constructor(element, changed) {
    this.changed = changed;
    this.target = [0, 0, 0];
    this.home();
    this.pointers = new Map();
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    });
    element.addEventListener("pointermove", (event) => this.drag(event));
    for (const end of ["pointerup", "pointercancel"]) {
      element.addEventListener(end, (event) => this.pointers.delete(event.pointerId));
    }
    // A wheel alone scrolls the page; with Ctrl, as a pinch on a touchpad sends it, it comes nearer.
    element.addEventListener("wheel", (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      this.zoom(Math.exp(event.deltaY * 0.005));
    }, { passive: false });
    element.addEventListener("keydown", (event) => this.key(event));
  }

  /** Looks from the front left side, from a little above. */
  home() {
    this.azimuth = 0.9;
    this.elevation = 0.3;
    this.distance = 1;
    this.changed?.();
  }

  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 0.3), 4);
    this.changed();
  }

  turn(around, up) {
    this.azimuth += around;
    this.elevation = Math.min(Math.max(this.elevation + up, 0.02), 1.5);
    this.changed();
  }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = [event.clientX, event.clientY];
    if (this.pointers.size === 1) {
      this.turn((before[0] - now[0]) * 0.008, (now[1] - before[1]) * 0.006);
    } else {
      const [, other] = [...this.pointers].find(([id]) => id !== event.pointerId);
      const spread = (from) => Math.hypot(from[0] - other[0], from[1] - other[1]);
      this.zoom(spread(before) / Math.max(spread(now), 1));
    }
    this.pointers.set(event.pointerId, now);
  }

  key(event) {
    const act = {
      ArrowLeft: () => this.turn(-STEP, 0),
      ArrowRight: () => this.turn(STEP, 0),
      ArrowUp: () => this.turn(0, STEP / 2),
      ArrowDown: () => this.turn(0, -STEP / 2),
      "+": () => this.zoom(0.85),
      "=": () => this.zoom(0.85),
      "-": () => this.zoom(1.18),
      0: () => this.home(),
    }[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  }

  /** Puts the camera where the eye is, with `radius` around what is looked at in sight; y is up. */
  place(camera, radius) {
    const away = this.distance * radius;
    const [x, y, z] = this.target;
    const level = away * Math.cos(this.elevation);
    camera.position.set(
      x + level * Math.sin(this.azimuth),
      y + away * Math.sin(this.elevation),
      z + level * Math.cos(this.azimuth),
    );
    camera.lookAt(this.target);
  }
}
