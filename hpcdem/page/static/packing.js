// The packing: grains as true arcs on a canvas, with zoom and pan. Lengths in mm, y upwards.

const FLAT = 1e-4; // below this central angle [rad] an arc is drawn as its chord: they differ by c θ / 8

/** Draws one specimen. `look` gives { colours, ink, faint, edge }, which depend on the theme. */
export class Packing {
  constructor(canvas, look, changed) {
    Object.assign(this, { canvas, look, changed, specimen: null, view: null, due: 0, took: 0, fitted: "box" });
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    this.#gestures();
  }

  /** Show a specimen; the view stays where the user has put it, unless it is a fitted one. */
  show(specimen) {
    this.specimen = specimen;
    if (this.fitted || !this.view) this.fit(this.fitted || "box");
    else this.redraw();
  }

  /** Adapt to the size of the canvas on the screen. */
  resize() {
    const { width, height } = this.canvas.getBoundingClientRect();
    const dots = Math.min(globalThis.devicePixelRatio || 1, 3);
    const [w, h] = [Math.max(1, Math.round(width * dots)), Math.max(1, Math.round(height * dots))];
    if (w === this.canvas.width && h === this.canvas.height) return;
    this.canvas.width = w;
    this.canvas.height = h;
    this.dots = dots;
    if (!this.specimen) return;
    if (this.fitted) this.fit(this.fitted, true);
    else this.draw();
  }

  /** Show the box ("box") or all grains ("all"). */
  fit(what, atOnce = false) {
    if (!this.specimen) return;
    this.fitted = what;
    const { box, extent } = this.specimen;
    let [x0, y0, x1, y1] = [0, 0, box.width, box.height];
    if (what === "all") {
      [x0, y0, x1, y1] = [Math.min(x0, extent[0]), Math.min(y0, extent[1]), Math.max(x1, extent[2]), Math.max(y1, extent[3])];
    }
    const margin = 34 * this.dots;
    const [w, h] = [this.canvas.width, this.canvas.height];
    const scale = Math.max(1e-9, Math.min((w - 2 * margin) / (x1 - x0), (h - 2 * margin) / (y1 - y0)));
    this.view = { scale, x: w / 2 - (scale * (x0 + x1)) / 2, y: h / 2 + (scale * (y0 + y1)) / 2 };
    if (atOnce) this.draw();
    else this.redraw();
  }

  /** Zoom by a factor about a point of the canvas [dots], by default its middle. */
  zoom(factor, x = this.canvas.width / 2, y = this.canvas.height / 2) {
    if (!this.view) return;
    const scale = Math.min(Math.max(this.view.scale * factor, 1e-4), 1e5);
    factor = scale / this.view.scale;
    this.view = { scale, x: x + factor * (this.view.x - x), y: y + factor * (this.view.y - y) };
    this.fitted = "";
    this.redraw();
  }

  /** Move by so many dots. */
  pan(dx, dy) {
    if (!this.view) return;
    this.view.x += dx;
    this.view.y += dy;
    this.fitted = "";
    this.redraw();
  }

  /** Draw before the browser shows its next picture. */
  redraw() {
    this.due ||= requestAnimationFrame(() => { this.due = 0; this.draw(); });
  }

  /** Draw now. */
  draw() {
    const began = performance.now();
    const { canvas, view, specimen } = this;
    const pen = canvas.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, canvas.width, canvas.height);
    if (!specimen || !view) return;
    const look = this.look(specimen);
    pen.setTransform(view.scale, 0, 0, -view.scale, view.x, view.y);
    this.#box(pen, look);
    this.#grains(pen, look);
    pen.setTransform(1, 0, 0, 1, 0, 0);
    this.#ruler(pen, look);
    this.took = performance.now() - began;
    this.changed?.(this);
  }

  /** Number of the grain at a point of the canvas [dots], or -1. */
  at(px, py) {
    const { specimen, view } = this;
    if (!specimen || !view) return -1;
    const [x, y] = [(px - view.x) / view.scale, (view.y - py) / view.scale];
    const { cx, cy, reach } = specimen.arrays;
    let found = -1, nearest = 1;
    for (let k = 0; k < cx.length; k++) {
      const far = ((cx[k] - x) ** 2 + (cy[k] - y) ** 2) / reach[k] ** 2;
      if (far < nearest) [found, nearest] = [k, far];
    }
    return found;
  }

  #box(pen, look) {
    const { width, height } = this.specimen.box;
    pen.lineWidth = (1.5 * this.dots) / this.view.scale;
    pen.strokeStyle = look.ink;
    pen.strokeRect(0, 0, width, height);
  }

  // One path per hundred grains of a class: a path of thousands of pieces is slow to fill.
  #grains(pen, look) {
    const { specimen, view, canvas } = this;
    const { kind, cx, cy, reach } = specimen.arrays;
    const x0 = -view.x / view.scale, x1 = (canvas.width - view.x) / view.scale;
    const y1 = view.y / view.scale, y0 = (view.y - canvas.height) / view.scale;
    const small = (0.7 * this.dots) / view.scale; // less than this: a dot is all that can be seen
    let open = -1, pieces = 0, drawn = 0;
    const finish = () => {
      if (open < 0) return;
      pen.fillStyle = look.colours[open];
      pen.fill();
      if (edged) pen.stroke();
    };
    let edged = false;
    for (const k of specimen.order) {
      if (cx[k] + reach[k] < x0 || cx[k] - reach[k] > x1 || cy[k] + reach[k] < y0 || cy[k] - reach[k] > y1) continue;
      if (kind[k] !== open || pieces >= 100) {
        finish();
        open = kind[k];
        pieces = 0;
        // An edge that is not much thinner than the grain would hide its colour.
        const edge = Math.min(1.1 * this.dots, 0.22 * reach[k] * view.scale);
        edged = edge > 0.12 * this.dots;
        pen.lineWidth = edge / view.scale;
        pen.strokeStyle = look.edge;
        pen.lineJoin = "round";
        pen.beginPath();
      }
      if (reach[k] < small) pen.rect(cx[k] - small, cy[k] - small, 2 * small, 2 * small);
      else this.#outline(pen, k);
      pieces++;
      drawn++;
    }
    finish();
    this.drawn = drawn;
  }

  #outline(pen, k) {
    const { start, vx, vy, theta, cx, cy, reach } = this.specimen.arrays;
    if (!start || start[k + 1] === start[k]) {
      pen.moveTo(cx[k] + reach[k], cy[k]);
      pen.arc(cx[k], cy[k], reach[k], 0, 2 * Math.PI);
      return;
    }
    const first = start[k], end = start[k + 1];
    pen.moveTo(vx[first], vy[first]);
    for (let j = first; j < end; j++) {
      const next = j + 1 < end ? j + 1 : first;
      const [dx, dy] = [vx[next] - vx[j], vy[next] - vy[j]];
      const t = theta[j];
      if (t < FLAT) {
        pen.lineTo(vx[next], vy[next]);
        continue;
      }
      // Centre on the bisector of the chord, to the left of the way along it (the outline runs counter-clockwise).
      const chord = Math.hypot(dx, dy);
      const radius = chord / (2 * Math.sin(t / 2));
      const back = (radius * Math.cos(t / 2)) / chord;
      const [ox, oy] = [(vx[j] + vx[next]) / 2 - dy * back, (vy[j] + vy[next]) / 2 + dx * back];
      const begin = Math.atan2(vy[j] - oy, vx[j] - ox);
      pen.arc(ox, oy, radius, begin, begin + t);
    }
    pen.closePath();
  }

  #ruler(pen, look) {
    const { canvas, view, dots } = this;
    const room = Math.min(160 * dots, canvas.width / 3) / view.scale;
    const power = 10 ** Math.floor(Math.log10(room));
    const length = [5, 2, 1].map((n) => n * power).find((l) => l <= room) ?? power;
    const [x, y, w] = [14 * dots, canvas.height - 11 * dots, length * view.scale];
    pen.font = `${12 * dots}px system-ui, sans-serif`;
    const text = `${Number(length.toPrecision(3))} mm`;
    pen.fillStyle = look.card;
    pen.globalAlpha = 0.85;
    pen.fillRect(x - 6 * dots, y - 10 * dots, w + pen.measureText(text).width + 18 * dots, 17 * dots);
    pen.globalAlpha = 1;
    pen.fillStyle = pen.strokeStyle = look.ink;
    pen.lineWidth = 1.5 * dots;
    pen.beginPath();
    pen.moveTo(x, y - 5 * dots);
    pen.lineTo(x, y);
    pen.lineTo(x + w, y);
    pen.lineTo(x + w, y - 5 * dots);
    pen.stroke();
    pen.fillText(text, x + w + 6 * dots, y + 1 * dots);
  }

  #gestures() {
    const { canvas } = this;
    const place = (e) => {
      const frame = canvas.getBoundingClientRect();
      return [(e.clientX - frame.left) * this.dots, (e.clientY - frame.top) * this.dots];
    };
    const held = new Map(); // pointers that are down, where
    canvas.addEventListener("wheel", (e) => {
      e.preventDefault();
      this.zoom(Math.exp(-Math.max(-200, Math.min(200, e.deltaY * (e.deltaMode ? 20 : 1))) / 400), ...place(e));
    }, { passive: false });
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId);
      held.set(e.pointerId, place(e));
    });
    canvas.addEventListener("pointermove", (e) => {
      const before = held.get(e.pointerId);
      if (!before) return;
      const now = place(e);
      held.set(e.pointerId, now);
      const others = [...held].filter(([id]) => id !== e.pointerId);
      if (!others.length) return this.pan(now[0] - before[0], now[1] - before[1]);
      const [ox, oy] = others[0][1];
      const far = (p) => Math.max(1, Math.hypot(p[0] - ox, p[1] - oy));
      this.zoom(far(now) / far(before), ox, oy);
    });
    for (const name of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(name, (e) => held.delete(e.pointerId));
    }
    canvas.addEventListener("keydown", (e) => {
      const step = 40 * this.dots;
      const act = {
        "+": () => this.zoom(1.25), "=": () => this.zoom(1.25), "-": () => this.zoom(0.8), 0: () => this.fit("box"),
        ArrowLeft: () => this.pan(step, 0), ArrowRight: () => this.pan(-step, 0),
        ArrowUp: () => this.pan(0, step), ArrowDown: () => this.pan(0, -step),
      }[e.key];
      if (!act || e.ctrlKey || e.metaKey || e.altKey) return;
      e.preventDefault();
      act();
    });
  }
}
