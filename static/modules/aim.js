// The arrow of the direction, taken hold of in the view and drawn over the ground.

/** How near to the arrow it is taken hold of, pixels. */
const NEAR = 28;

export class Aim {
  /**
   * `arrow()` gives what is seen of it in the view's frame (y up): `about`, the point of the ground that it turns about, and
   * its ends `from` and `to`; `null` without one. `turned` is told the angle to the left of straight ahead, rad.
   */
  constructor(canvas, camera, arrow, turned) {
    Object.assign(this, { canvas, camera, arrow, turned, pointer: null });
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.near(event)) return;
      this.pointer = event.pointerId;
      canvas.setPointerCapture(event.pointerId);
      // The view is not turned meanwhile.
      event.stopImmediatePropagation();
    });
    canvas.addEventListener("pointermove", (event) => {
      if (this.pointer === event.pointerId) this.drag(event);
      else if (this.pointer === null) canvas.style.cursor = this.near(event) ? "pointer" : "";
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => {
        if (this.pointer === event.pointerId) this.pointer = null;
      });
    }
  }

  /** The place of a pointer, from -1 to 1 to the right and up. */
  place({ clientX, clientY }) {
    const { left, top, width, height } = this.canvas.getBoundingClientRect();
    return [(2 * (clientX - left)) / width - 1, 1 - (2 * (clientY - top)) / height];
  }

  near(event) {
    const seen = this.arrow();
    if (!seen) return false;
    const { width, height } = this.canvas.getBoundingClientRect();
    const pixels = ([x, y]) => [(x * width) / 2, (y * height) / 2];
    const [at, from, to] = [this.place(event), this.project(seen.from), this.project(seen.to)].map(pixels);
    const along = [to[0] - from[0], to[1] - from[1]];
    const [x, y] = [at[0] - from[0], at[1] - from[1]];
    const part = (x * along[0] + y * along[1]) / Math.max(along[0] ** 2 + along[1] ** 2, 1);
    const share = Math.min(Math.max(part, 0), 1);
    return Math.hypot(x - share * along[0], y - share * along[1]) < NEAR;
  }

  project([x, y, z]) {
    const m = this.camera.projectionViewMatrix;
    const row = (at) => m[at] * x + m[4 + at] * y + m[8 + at] * z + m[12 + at];
    return [row(0) / row(3), row(1) / row(3)];
  }

  drag(event) {
    const { worldMatrix: m, fov, aspect } = this.camera;
    const size = Math.tan((fov * Math.PI) / 360);
    const [right, up] = this.place(event);
    const ray = [0, 1, 2].map((axis) => m[axis] * right * size * aspect + m[4 + axis] * up * size - m[8 + axis]);
    // Above the horizon there is no ground.
    if (ray[1] >= 0) return;
    const [x, z] = [m[12] - (ray[0] * m[13]) / ray[1], m[14] - (ray[2] * m[13]) / ray[1]];
    const { about } = this.arrow();
    // The view's z is ahead, and its x to the left.
    this.turned(Math.atan2(x - about[0], z - about[2]));
  }
}
