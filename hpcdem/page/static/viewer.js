// The viewer: windows on frames. The camera lives here; the server draws what it is asked for (viewer.py). One picture is
// under way per window, the newest wish wins; while something moves they are JPEG, at rest one finer PNG follows.

import { ask, Refusal } from "./server.js";
import * as charts from "./charts.js";
import * as desk from "./desk.js";
import * as words from "./words.js";
import "./viewer_words.js";

const { say } = words;
const $ = (id) => document.getElementById(id);
const REST = 180;  // ms without a wish after which the fine picture is asked for
const LOOK = 800;  // ms between two looks at the folder

let about = null;  // objects, colours, first view
let state = { sources: [], run: null, histories: { records: [], charts: [] } };
let windows = [];
let current = null;
let playing = null;
let theme = "auto";
let drawn = 0;
let beginning = false;
let shownNow = false;  // the model of the console was put on show once

// ---- asking ----------------------------------------------------------------------------------------------------------

async function json(name, content) { return (await ask(name, content)).json(); }

function complain(error) {
  const text = error instanceof Refusal ? error.message : say("no_server", { why: error.message });
  told(text, true);
}

/** A message at the foot, whole: what is longer than a line lies over what is above, until it is clicked. A hint is one
 * line. */
function told(text, bad = false, hint = false) {
  const box = $("message");
  box.textContent = box.title = text;
  box.className = bad ? "bad" : hint ? "hint" : "";
  box.classList.toggle("long", box.offsetHeight > 30);
}

async function unpacked(response) {
  const bytes = await response.arrayBuffer();
  const length = new DataView(bytes).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 4, length)));
  const { offset, count } = header.arrays[0];
  header.image = new Blob([new Uint8Array(bytes, 4 + length + offset, count)], { type: header.kind });
  return header;
}

// ---- a window --------------------------------------------------------------------------------------------------------

class Window {
  constructor(view, camera, source, frame) {
    this.begin(view);
    this.camera = { ...camera };
    this.source = source;
    this.frame = frame;
    this.root = document.createElement("div");
    this.root.className = "window";
    this.root.innerHTML = '<canvas tabindex="0" role="img"></canvas><canvas class="over"></canvas>' +
      '<p class="caption"></p><div class="legend"></div>';
    [this.canvas, this.over] = this.root.querySelectorAll("canvas");
    this.shown = null;  // header and camera of the picture on the canvas
    this.busy = false;
    this.wish = null;
    this.points = [];
    listen(this);
  }

  /** Take a view that nobody has changed yet. */
  begin(view) {
    this.view = structuredClone(view);
    this.begun = JSON.stringify(this.view);
  }

  /** Whether the view is the one it began with, from before anything had happened to the elements. */
  get waits() {
    const { layers } = this.view;
    return this.begun === JSON.stringify(this.view) && layers.every((one) => one.object !== "elements" || !one.field);
  }

  get size() {
    const w = Math.max(1, this.root.clientWidth), h = Math.max(1, this.root.clientHeight);
    const most = Math.min(Math.sqrt(about.most.pixels / (w * h)), about.most.side / Math.max(w, h));
    const k = Math.min(window.devicePixelRatio || 1, 2, most);
    return [Math.max(1, Math.floor(w * k)), Math.max(1, Math.floor(h * k))];
  }

  /** Left, right, bottom, top of what a window of this size shows. */
  get box() {
    const [w, h] = this.size;
    const half = this.camera.width / 2;
    return [this.camera.x - half, this.camera.x + half, this.camera.y - half * h / w, this.camera.y + half * h / w];
  }

  /** Right, up and towards the eye in space; null in the plane. */
  get turn() { return about.box ? turnOf(directionOf(this.view.eye)) : null; }

  /** Where the middle of the model lies in the picture. */
  get origin() {
    const { turn } = this;
    if (!turn) return [0, 0];
    const middle = about.box[0].map((low, k) => (low + about.box[1][k]) / 2);
    return [dot(turn[0], middle), dot(turn[1], middle)];
  }

  request(fine) {
    const [width, height] = this.size;
    return { source: this.source, frame: this.frame, view: { ...this.view, camera: this.box }, width, height, fine,
      dark: document.documentElement.dataset.theme === "dark" };
  }

  redraw(fine = false) {
    this.wish = { fine };
    clearTimeout(this.rest);
    if (!this.busy) this.fetch();
    else this.stretch();
  }

  async fetch() {
    if (!this.root.isConnected || !this.wish) return;
    const { fine } = this.wish;
    this.wish = null;
    this.busy = true;
    this.stretch();
    const began = performance.now();
    const wanted = this.request(fine), origin = this.origin;
    try {
      const header = await unpacked(await ask("picture", wanted));
      const image = await createImageBitmap(header.image);
      this.shown = { header, image, box: wanted.view.camera, origin };
      this.put();
      waiting();
      $("pictures").textContent = say("picture", { ms: Math.round(performance.now() - began) });
      document.body.dataset.pictures = ++drawn;
      document.body.dataset.fine = fine;
      if (this.failed) { told(""); this.failed = this.lost = false; }
    } catch (error) {
      if (error.status === 503) { this.wish ??= { fine }; await new Promise((done) => { setTimeout(done, LOOK); }); }  // busy
      else { this.failed = true; this.lost = !(error instanceof Refusal); complain(error); }
    }
    this.busy = false;
    if (this.wish) this.fetch();
    else if (!fine && !this.failed) this.rest = setTimeout(() => this.redraw(true), REST);
  }

  /** The last picture, moved to where it belongs now. */
  stretch() {
    if (!this.shown) return;
    const [w, h] = this.size;
    if (this.canvas.width !== w || this.canvas.height !== h) { this.canvas.width = w; this.canvas.height = h; }
    const [left, right, bottom, top] = this.box;
    const now = this.origin;
    const [dx, dy] = this.shown.origin.map((v, k) => now[k] - v);
    const [l, r, b, t] = this.shown.box.map((v, k) => v + (k < 2 ? dx : dy));
    const pen = this.canvas.getContext("2d");
    pen.fillStyle = getComputedStyle(document.documentElement).getPropertyValue("--paper");
    pen.fillRect(0, 0, w, h);
    const k = w / (right - left);
    pen.drawImage(this.shown.image, (l - left) * k, (top - t) * k, (r - l) * k, (t - b) * k);
    this.marks();
  }

  put() {
    const { header } = this.shown;
    this.stretch();
    this.root.querySelector(".caption").textContent = header.title;
    this.canvas.setAttribute("aria-label", `${say("model")}: ${header.title}`);
    legend(this.root.querySelector(".legend"), this.view.legend ? header.legend : []);
    if (this === current) { counts(); ranged(); moment(); }
  }

  marks() {
    const [w, h] = this.size;
    if (this.over.width !== w || this.over.height !== h) { this.over.width = w; this.over.height = h; }
    const pen = this.over.getContext("2d");
    pen.clearRect(0, 0, w, h);
    if (this.view.axes) axes(this, pen, w, h);
    if (!this.points.length) return;
    const [left, right, , top] = this.box;
    const k = w / (right - left);
    pen.strokeStyle = pen.fillStyle = "#d0562a";
    pen.lineWidth = 2;
    pen.beginPath();
    this.points.forEach(([x, y], n) => pen[n ? "lineTo" : "moveTo"]((x - left) * k, (top - y) * k));
    pen.stroke();
    for (const [x, y] of this.points) { pen.beginPath(); pen.arc((x - left) * k, (top - y) * k, 4, 0, 7); pen.fill(); }
  }

  at(event) {
    const rect = this.canvas.getBoundingClientRect();
    const [w, h] = this.size;
    const u = (event.clientX - rect.left) / rect.width, v = (event.clientY - rect.top) / rect.height;
    const [left, right, bottom, top] = this.box;
    return { x: left + u * (right - left), y: top - v * (top - bottom), column: Math.min(w - 1, Math.floor(u * w)),
      row: Math.min(h - 1, Math.floor(v * h)) };
  }

  fit() {
    let [left, right, bottom, top] = about.whole;
    const [w, h] = this.size, { turn } = this;
    if (turn) {
      const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((n) => [0, 1, 2].map((k) => about.box[(n >> k) & 1][k]));
      const [x, y] = [0, 1].map((k) => corners.map((corner) => dot(turn[k], corner)));
      const air = 0.03 * Math.max(Math.max(...x) - Math.min(...x), Math.max(...y) - Math.min(...y));
      [left, right, bottom, top] = [Math.min(...x) - air, Math.max(...x) + air, Math.min(...y) - air, Math.max(...y) + air];
    }
    this.camera = { x: (left + right) / 2, y: (bottom + top) / 2, width: Math.max(right - left, (top - bottom) * w / h) };
    this.fitted = { ...this.camera };
  }

  /** The window has another size: the whole model stays the whole model. */
  resized() {
    if (["x", "y", "width"].every((name) => this.camera[name] === this.fitted?.[name])) this.fit();
    this.redraw();
  }
}

// ---- space -----------------------------------------------------------------------------------------------------------

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const directionOf = (text) => about.eyes[text] ?? text.split(",").map(Number);

function turnOf(eye) {
  const size = Math.hypot(...eye), out = eye.map((v) => v / size), level = Math.hypot(out[0], out[1]);
  const right = level < 1e-12 ? [1, 0, 0] : [-out[1] / level, out[0] / level, 0];
  const up = [0, 1, 2].map((k) => out[(k + 1) % 3] * right[(k + 2) % 3] - out[(k + 2) % 3] * right[(k + 1) % 3]);
  return [right, up, out];
}

/** Look from elsewhere, at the same place of the picture. */
function looked(one, eye) {
  const some = $("linked").checked ? windows.filter((other) => other.source === one.source) : [one];
  for (const other of some) {
    const before = other.origin;
    other.view.eye = eye;
    const after = other.origin;
    other.camera.x += after[0] - before[0];
    other.camera.y += after[1] - before[1];
    other.points = [];
    other.redraw();
  }
  if (one === current) eyes();
}

/** The direction turned by so many radians about the vertical, and up. */
function turned(eye, about_z, up) {
  const out = turnOf(eye)[2], most = Math.PI / 2 - 1e-3;
  const height = Math.min(Math.max(Math.asin(out[2]) + up, -most), most), way = Math.atan2(out[1], out[0]) + about_z;
  return [Math.cos(height) * Math.cos(way), Math.cos(height) * Math.sin(way), Math.sin(height)].map((v) => v.toFixed(6)).join(",");
}

function eyes() {
  for (const part of document.querySelectorAll("[data-space]")) part.hidden = !about.box;
  if (!about.box) return;
  const names = Object.keys(about.eyes), { eye } = current.view;
  options($("eye"), [...names, ...(names.includes(eye) ? [] : [eye])].map((name) => [name, name]), eye);
  filled("section", current.view.section);
  cutter();
}

/** The slider and the box beside the words of a section: they stand for x=..., y=... or z=... */
function cutter() {
  const { section } = current.view, found = /^(slice )?([xyz])([=<>])(.+)$/.exec(section);
  const axis = "xyz".indexOf(found?.[2] ?? $("cut-axis").value), slider = $("cut");
  $("slice").checked = section.startsWith("slice ");
  $("slice").disabled = !section;
  $("cut-axis").value = found ? found[2] : section ? "other" : "";
  slider.disabled = !found;
  if (!found) return;
  const [low, high] = [about.box[0][axis], about.box[1][axis]];
  slider.min = low; slider.max = high; slider.step = (high - low) / 200;
  slider.value = found[4];
}

function cut(text) {
  const some = $("linked").checked ? windows.filter((one) => one.source === current.source) : [current];
  for (const one of some) { one.view.section = text; one.redraw(); }
  $("section").value = text;
  cutter();
}

function cutAlong() {
  const axis = $("cut-axis").value, k = ["x", "y", "z"].indexOf(axis);
  if (axis === "other") { cutter(); return; }
  cut(k < 0 ? "" : `${$("slice").checked ? "slice " : ""}${axis}=${short((about.box[0][k] + about.box[1][k]) / 2, 4)}`);
}

function cutAt() {
  const found = /^((?:slice )?[xyz][=<>])/.exec(current.view.section);
  if (found) cut(`${found[1]}${short(Number($("cut").value), 4)}`);
}

function moved(one) {
  const some = $("linked").checked ? windows : [one];
  for (const other of some) { if (other !== one) other.camera = { ...one.camera }; other.redraw(); }
}

function zoomed(one, k, at = null) {
  const centre = at ?? { x: one.camera.x, y: one.camera.y };
  one.camera.x = centre.x + (one.camera.x - centre.x) * k;
  one.camera.y = centre.y + (one.camera.y - centre.y) * k;
  one.camera.width *= k;
  moved(one);
}

function listen(one) {
  let drag = null;
  const { canvas } = one;
  canvas.addEventListener("pointerdown", (event) => {
    choose(one);
    canvas.focus({ preventScroll: true });
    if (event.button === 0 && $("mode").value === "query") { query(one, one.at(event)); return; }
    if (event.button === 0 && $("mode").value === "distance") { measure(one, one.at(event)); return; }
    drag = { x: event.clientX, y: event.clientY, camera: { ...one.camera },
      eye: about.box && event.button === 0 && !event.shiftKey ? directionOf(one.view.eye) : null };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    const { x, y } = one.at(event);
    $("place").textContent = about.box ? `→ ${short(x)}  ↑ ${short(y)} ${about.unit}` : `x ${short(x)}  y ${short(y)} ${about.unit}`;
    if (!drag) return;
    const k = one.camera.width / canvas.clientWidth;
    if (event.clientX === drag.x && event.clientY === drag.y) return;
    if (drag.eye) {
      looked(one, turned(drag.eye, (drag.x - event.clientX) * 0.008, (event.clientY - drag.y) * 0.008));
      return;
    }
    one.camera.x = drag.camera.x - (event.clientX - drag.x) * k;
    one.camera.y = drag.camera.y + (event.clientY - drag.y) * k;
    moved(one);
  });
  const end = () => { drag = null; };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoomed(one, Math.exp(Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 240) / 600), one.at(event));
  }, { passive: false });
  canvas.addEventListener("dblclick", () => { if (!$("answer").hidden && $("mode").value === "query") copy(); });
}

function short(value, digits = 6) {
  const size = Math.abs(value);
  if (size >= 1e5 || (size && size < 1e-3)) return value.toExponential(digits - 1).replace(/\.?0*e\+?/, "e");
  return Number(value.toPrecision(digits)).toString();
}

// ---- axes ------------------------------------------------------------------------------------------------------------

/** A round length of about this one: 1, 2 or 5 times a power of ten. */
function round(length) {
  const decade = 10 ** Math.floor(Math.log10(length)), part = length / decade;
  return decade * (part < 1.5 ? 1 : part < 3.5 ? 2 : part < 7.5 ? 5 : 10);
}

/** Numbers along the lower and the left edge; in space, where they would say nothing, the axes and a length. */
function axes(one, pen, w, h) {
  const k = w / Math.max(1, one.root.clientWidth), [left, right, bottom, top] = one.box, scale = w / (right - left);
  const style = getComputedStyle(document.documentElement), ink = style.getPropertyValue("--paper-ink");
  pen.save();
  pen.font = `${11 * k}px system-ui, sans-serif`;
  pen.fillStyle = pen.strokeStyle = ink;
  pen.lineWidth = k;
  pen.beginPath();
  const { turn } = one;
  const longer = Math.max(right - left, top - bottom);
  const [, size, unit] = about.lengths.find(([least]) => longer >= least) ?? about.lengths.at(-1);  // as in figures
  const step = round(Math.min((right - left) * 110 * k / w, (top - bottom) / 4));
  const digits = Math.max(0, -Math.floor(Math.log10(step / size) + 1e-9));
  const write = (text, x, y) => {  // readable over the model
    pen.save();
    pen.strokeStyle = style.getPropertyValue("--paper");
    pen.lineWidth = 3 * k;
    pen.lineJoin = "round";
    pen.strokeText(text, x, y);
    pen.restore();
    pen.fillText(text, x, y);
  };
  const word = (v) => (Math.abs(v) < step / 2 ? 0 : v / size).toFixed(digits);
  if (turn) {
    const length = step * scale, [x0, y0] = [w - 14 * k - length, h - 12 * k];
    pen.moveTo(x0, y0 - 5 * k); pen.lineTo(x0, y0); pen.lineTo(x0 + length, y0); pen.lineTo(x0 + length, y0 - 5 * k);
    const [cx, cy, reach] = [44 * k, h - 44 * k, 26 * k];
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    write(`${word(step)} ${unit}`, x0 + length / 2, y0 - 11 * k);
    [0, 1, 2].forEach((n) => {
      const [x, y] = [turn[0][n], turn[1][n]];
      pen.moveTo(cx, cy); pen.lineTo(cx + reach * x, cy - reach * y);
      write("xyz"[n], cx + 1.4 * reach * x, cy - 1.4 * reach * y);
    });
    pen.stroke();
    pen.restore();
    return;
  }
  pen.textAlign = "center";
  pen.textBaseline = "bottom";
  for (let n = Math.ceil(left / step); n * step <= right; n++) {
    const x = (n * step - left) * scale;
    pen.moveTo(x, h); pen.lineTo(x, h - 6 * k);
    if (x > 50 * k && x < w - 60 * k) write(word(n * step), x, h - 7 * k);
  }
  pen.textAlign = "left";
  pen.textBaseline = "middle";
  for (let n = Math.ceil(bottom / step); n * step <= top; n++) {
    const y = (top - n * step) * scale;
    pen.moveTo(0, y); pen.lineTo(6 * k, y);
    if (y > 44 * k && y < h - 24 * k) write(word(n * step), 9 * k, y);
  }
  pen.textAlign = "right";
  pen.textBaseline = "bottom";
  write(`x (${unit})`, w - 6 * k, h - 7 * k);
  pen.textAlign = "left";
  write(`y (${unit})`, 9 * k, 42 * k);
  pen.stroke();
  pen.restore();
}

// ---- legend ----------------------------------------------------------------------------------------------------------

function legend(root, parts) {
  root.replaceChildren(...parts.map((part) => {
    const box = document.createElement("div");
    if (part.arrow) {
      const name = part.vectors.replaceAll("_", " "), arrow = document.createElement("span");
      arrow.className = "arrow";
      arrow.style.width = `${part.part * root.parentElement.clientWidth}px`;
      box.append(part.arrow.replace(name, called("fields", part.vectors).replaceAll("_", " ")), arrow);
      return box;
    }
    if (part.classes) {
      for (const [word, colour] of part.classes) {
        const line = document.createElement("span");
        const swatches = colour.split(" ").map((one) => {
          const swatch = document.createElement("span");
          swatch.className = "swatch";
          swatch.style.background = one;
          return swatch;
        });
        line.append(...swatches, called("legend", word), document.createElement("br"));
        box.append(line);
      }
      return box;
    }
    box.append(part.title.replace(part.field.replaceAll("_", " "), called("fields", part.field).replaceAll("_", " ")), bar(part));
    return box;
  }));
}

/** A bar of colours with numbers; its ends are pointed where values lie beyond them. */
function bar(part) {
  const root = document.createElement("span"), canvas = document.createElement("canvas");
  const [w, h, point] = [BAR.width, BAR.height, 8], [top, bottom] = [point, h - point];
  root.className = "bar";
  root.style.height = `${h}px`;
  canvas.width = w; canvas.height = h;
  const pen = canvas.getContext("2d"), stops = about.colours[part.colours];
  const fill = pen.createLinearGradient(0, bottom, 0, top);
  stops.forEach((colour, k) => fill.addColorStop(k / (stops.length - 1), colour));
  pen.fillStyle = fill;
  pen.fillRect(0, top, w, bottom - top);
  const end = (colour, from, to) => {
    pen.fillStyle = colour;
    pen.beginPath(); pen.moveTo(0, from); pen.lineTo(w / 2, to); pen.lineTo(w, from); pen.fill();
  };
  if (part.above) end(stops.at(-1), top, 0);
  if (part.below) end(stops[0], bottom, h);
  for (const [place, text] of part.ticks) {
    const mark = document.createElement("span");
    mark.textContent = text;
    mark.style.top = `${bottom - place * (bottom - top)}px`;
    root.append(mark);
  }
  root.append(canvas);  // the first canvas of a window is its picture
  return root;
}

const BAR = { width: 12, height: 160 };

// ---- objects and their properties ------------------------------------------------------------------------------------

let chosen = "";
/** What a field, colours or a class of the legend are called in the language of now; names that are typed stay. */
const called = (kind, name) => (words.current() === "zh" && about?.chinese[kind][name]) || name;
const label = (layer) => layer.name || layer.object;
const spoken = (layer) => layer.name || say(layer.object);
const layer = () => current?.view.layers.find((one) => label(one) === chosen);

function tree() {
  const list = current.view.layers;
  if (!layer()) chosen = list.length ? label(list[0]) : "";
  $("tree").replaceChildren(...[...list].reverse().map((one) => {
    const item = document.createElement("li");
    item.role = "option";
    item.tabIndex = 0;
    item.dataset.layer = label(one);
    item.setAttribute("aria-selected", label(one) === chosen);
    item.classList.toggle("missing", !(one.object in about.objects));
    const box = document.createElement("input");
    box.type = "checkbox";
    box.checked = one.visible;
    box.setAttribute("aria-label", spoken(one));
    box.addEventListener("change", () => change({ visible: box.checked }, label(one)));
    const count = document.createElement("small");
    count.dataset.count = label(one);
    item.append(box, spoken(one), count);
    const take = () => { chosen = label(one); tree(); };
    item.addEventListener("click", (event) => { if (event.target !== box) take(); });
    item.addEventListener("keydown", (event) => { if (event.key === "Enter") take(); });
    return item;
  }));
  $("around").replaceChildren(...["axes", "legend", "histories"].map((name) => {
    const line = document.createElement("label"), box = document.createElement("input");
    line.className = "check";
    box.type = "checkbox";
    box.id = `show-${name}`;
    box.checked = name === "histories" ? !$("charts").hidden : current.view[name];
    box.addEventListener("change", () => around(name, box.checked));
    line.append(box, say(`of_${name}`));
    return line;
  }));
  counts();
  properties();
}

/** What stands around the model is there, or not. */
function around(name, on) {
  if (name === "histories") { $("charts").hidden = !on; return; }
  current.view[name] = on;
  if (current.shown) current.put();
}

function counts() {
  const shown = current?.shown?.header.shown ?? {};
  for (const mark of $("tree").querySelectorAll("[data-count]")) {
    const name = mark.dataset.count;
    const all = about.objects[current.view.layers.find((one) => label(one) === name)?.object];
    mark.textContent = name in shown ? (shown[name] === all ? all : say("part", { shown: shown[name], all })) : "";
  }
}

function options(select, pairs, value) {
  const same = select.options.length === pairs.length && pairs.every(([key, text], k) =>
    select.options[k].value === `${key}` && select.options[k].text === text);
  if (!same) select.replaceChildren(...pairs.map(([key, text]) => new Option(text, key)));
  if (select.value !== `${value}`) select.value = value;
}

/** Show what holds, but leave a field in which somebody is typing: what was typed is taken when it is left. */
function filled(id, value) {
  if (document.activeElement !== $(id)) $(id).value = value;
}

let asked = 0;
async function properties() {
  const one = layer();
  $("properties").hidden = !one;
  if (!one) return;
  $("properties-title").textContent = spoken(one);
  for (const name of ["opacity", "size", "arrows", "filter"]) $(name).value = one[name];
  $("filter").rows = Math.min(8, one.filter.split("\n").length);
  for (const name of ["log", "edges"]) $(name).checked = one[name];
  $("own").checked = one.colour !== "";
  $("colour").value = one.colour || "#2f7fb5";
  $("full").checked = one.limits === "full";
  ranged(true);
  options($("colours"), Object.keys(about.colours).map((name) => [name, called("colours", name)]), one.colours);
  const mine = ++asked;
  let found = { fields: [], vectors: [] };
  try {
    if (one.object in about.objects) found = await json("fields", { source: current.source, frame: current.frame, object: one.object });
  } catch (error) { complain(error); }
  if (mine !== asked) return;
  const title = (name) => (called("fields", name) === name ? name : `${called("fields", name)} ${name}`);
  const fields = found.fields.map(([name, unit]) => [name, unit ? `${title(name)} (${unit})` : title(name)]);
  if (one.field && !fields.some(([name]) => name === one.field)) fields.push([one.field, one.field]);
  options($("field"), [["", say("own_colours")], ...fields], one.field);
  options($("vectors"), [["", say("none")], ...found.vectors.map((name) => [name, title(name)])], one.vectors);
}

function change(values, name = chosen) {
  const one = current.view.layers.find((other) => label(other) === name);
  if (!one) return;
  Object.assign(one, values);
  current.redraw();
  if ("visible" in values) tree();
}

const scaleOf = () => current.shown?.header.legend.find((part) => part.label === chosen && "low" in part);

/** The values of the first and the last colour, in the unit of the bar; an end that nobody has said stays empty. */
function ranged(all = false) {
  const one = layer(), scale = scaleOf(), span = Array.isArray(one?.limits) ? one.limits : [];
  $("range-unit").textContent = scale?.unit[1] ?? "";
  ["low", "high"].forEach((id, k) => {
    $(id).placeholder = scale ? short(scale[id] / scale.unit[0], 4) : "";
    if (document.activeElement === $(id) || (!all && !$(id).value)) return;
    $(id).value = span.length ? short(span[k] / (scale?.unit[0] ?? 1)) : "";
  });
}

function limits() {
  const [low, high] = ["low", "high"].map((id) => $(id).value.trim());
  if (!low && !high) { change({ limits: null }); return; }
  const scale = scaleOf(), size = scale?.unit[0] ?? 1;
  const found = [low === "" ? scale?.low : Number(low) * size, high === "" ? scale?.high : Number(high) * size];
  change({ limits: found.every((value) => typeof value === "number") ? found.map((v) => (Number.isFinite(v) ? v : String(v))) : null });
}

function add() {
  const object = $("add").value;
  $("add").value = "";
  if (!object) return;
  const names = current.view.layers.map(label);
  let name = "";
  for (let k = 2; names.includes(name || object); k++) name = `${object} ${k}`;
  current.view.layers.push({ ...structuredClone(BLANK), object, name });
  chosen = name || object;
  tree();
  current.redraw();
}

const BLANK = { name: "", visible: true, field: "", limits: null, log: false, colours: "viridis", colour: "", opacity: 1,
  edges: false, size: 1, vectors: "", arrows: 1, longest: 0, filter: "" };

function remove() {
  current.view.layers = current.view.layers.filter((one) => label(one) !== chosen);
  tree();
  current.redraw();
}

function rename() {
  const one = layer();
  const name = one && prompt(say("new_name", { name: spoken(one) }), spoken(one));
  if (!name || current.view.layers.some((other) => other !== one && label(other) === name)) return;
  one.name = name;
  chosen = label(one);
  tree();
  current.redraw();
}

function shift(step) {
  const list = current.view.layers;
  const from = list.findIndex((one) => label(one) === chosen);
  const to = from + step;
  if (from < 0 || to < 0 || to >= list.length) return;
  [list[from], list[to]] = [list[to], list[from]];
  tree();
  current.redraw();
}

// ---- asking what is there --------------------------------------------------------------------------------------------

async function query(one, at) {
  try {
    const found = await json("pick", { ...one.request(false), column: at.column, row: at.row });
    const { turn } = one, place = [found.x, found.y, found.z];
    one.points = found.object ? [turn ? [dot(turn[0], place), dot(turn[1], place)] : [found.x, found.y]] : [];
    one.marks();
    $("answer").hidden = !found.object;
    if (!found.object) { told(say("nothing")); return; }
    told("");
    $("answer-title").textContent = say("number", { object: found.label === found.object ? say(found.object) : found.label, number: found.number });
    const rows = [...["x", "y", ...(turn ? ["z"] : [])].map((axis) => [axis, `${short(found[axis])} ${about.unit}`]),
      ...found.values.filter(([name]) => !["x", "y", ...(turn ? ["z"] : [])].includes(name)).map(([name, , , text]) => [name, text])];
    $("values").replaceChildren(...rows.map(([name, text]) => {
      const row = document.createElement("tr");
      row.title = `${name}: ${say("copy")}`;
      row.addEventListener("click", () => copied(row.cells[1].textContent));
      for (const part of [called("fields", name), text]) {
        const cell = document.createElement("td");
        cell.textContent = part;
        row.append(cell);
      }
      return row;
    }));
    $("answer").scrollIntoView({ block: "nearest" });
  } catch (error) { complain(error); }
}

async function measure(one, at) {
  const first = one.points.length !== 1;
  one.points = first ? [[at.x, at.y]] : [...one.points, [at.x, at.y]];
  one.places = first ? [] : one.places ?? [];
  one.marks();
  if (first) told(say("first_point"));
  if (about.box) {
    try {
      one.places.push((await json("pick", { ...one.request(false), column: at.column, row: at.row })).point ?? null);
    } catch (error) { complain(error); return; }
  }
  if (first) return;
  const [[x0, y0], [x1, y1]] = one.points;
  const [a, b] = one.places;
  const flat = { unit: about.unit, d: short(Math.hypot(x1 - x0, y1 - y0)), x: short(x1 - x0), y: short(y1 - y0) };
  if (a && b) {
    const by = b.map((v, k) => v - a[k]);
    told(say("distance_space", { unit: about.unit, d: short(Math.hypot(...by)), x: short(by[0]), y: short(by[1]), z: short(by[2]) }));
  } else told(say(about.box ? "distance_flat" : "distance", flat));
}

function copy() {
  const lines = [...$("values").rows].map((row) => [...row.cells].map((cell) => cell.textContent).join("\t"));
  return copied([$("answer-title").textContent, ...lines].join("\n"));
}

async function copied(text) {
  try {
    await navigator.clipboard.writeText(text);
    told(say("copied"));
  } catch { told(say("not_copied"), true); }
}

// ---- windows ---------------------------------------------------------------------------------------------------------

function choose(one) {
  if (current === one) return;
  current = one;
  for (const other of windows) other.root.classList.toggle("current", other === one);
  tree();
  controls();
}

function split() {
  const kind = $("split").value;
  const count = { 1: 1, 2: 2, "2v": 2, 4: 4 }[kind];
  while (windows.length > count) windows.pop().root.remove();
  if (!windows.includes(current)) current = null;
  const like = current ?? windows[0];
  while (windows.length < count) {
    windows.push(new Window(like.view, like.camera, like.source, like.frame));
    windows.at(-1).fitted = like.fitted;
    $("windows").append(windows.at(-1).root);
  }
  $("windows").dataset.split = kind;
  choose(current ?? windows[0]);
  for (const one of windows) one.resized();
}

// ---- time ------------------------------------------------------------------------------------------------------------

const frames = () => state.sources[current?.source]?.frames ?? [];

function controls() {
  const n = frames().length;
  $("slider").max = Math.max(n - 1, 0);
  $("slider").value = current.frame;
  $("slider").setAttribute("aria-valuetext", `${frames()[current.frame]?.[0] ?? ""}`);
  $("source").value = current.source;
  filled("deformed", current.view.deformed);
  $("deformed").disabled = !about.displaced;
  filled("title", current.view.title);
  eyes();
}

function moment() {
  const { header } = current.shown;
  $("moment").textContent = say("moment", { step: header.step, time: header.when });
  charts.moment(header.step);
}

function go(frame) {
  const n = frames().length;
  const to = Math.min(Math.max(frame, 0), n - 1);
  for (const one of $("linked").checked ? windows : [current]) {
    const last = (state.sources[one.source]?.frames.length ?? 1) - 1;
    one.frame = Math.min(to, last);
    one.redraw();
  }
  controls();
}

function play() {
  if (playing) { clearTimeout(playing); playing = null; } else if (frames().length > 1) {
    if (current.frame >= frames().length - 1) go(0);
    const step = () => {
      if (!current.busy) {
        if (current.frame >= frames().length - 1) { playing = null; label_play(); return; }
        go(current.frame + 1);
      }
      playing = setTimeout(step, 1000 / Number($("speed").value));
    };
    playing = setTimeout(step, 0);
  }
  label_play();
}

function label_play() {
  $("play").textContent = playing ? "⏸" : "▶";
  $("play").setAttribute("aria-label", say(playing ? "pause" : "play"));
}

// ---- a run that goes on ----------------------------------------------------------------------------------------------

async function look() {
  look.waiting = null;
  try {
    const before = state.sources;
    state = await json("state", {});
    sources();
    waiting();
    if (!about && !beginning && state.sources.length) {
      beginning = true;
      try { await begin(); } finally { beginning = false; }
    }
    if (about) {
      for (const one of windows) if (one.lost && !one.busy) one.redraw();  // the server is there again
      let rewritten = false, grown = false;
      windows.forEach((one) => {
        const old = before[one.source];
        const found = state.sources.findIndex((source) => source.name === old?.name);
        if (found < 0) return;
        one.source = found;  // others may have come before it
        const now = state.sources[found], n = now.frames.length;
        if (one.frame !== old.frames.length - 1) return;
        if (now.stamp === old.stamp && n === old.frames.length) return;
        if (now.stamp !== old.stamp && n === old.frames.length) rewritten = true;
        else if (!$("follow").checked) return;
        grown ||= one === current;
        one.frame = n - 1;
        one.redraw();
      });
      if (rewritten) await renewed();
      else if (grown && current.waits && "elements" in about.objects) await renewed();
      controls();
    }
    run();
    await charts.update(state.histories, Boolean(state.run?.running));
  } catch (error) { complain(error); }
  look.waiting = setTimeout(look, LOOK);
}

/** The model itself may be another one: its objects, and where it lies. */
async function renewed() {
  const { whole, box } = about;
  about = { ...await json("about", { source: current.source, frame: -1 }), colours: about.colours };
  for (const one of windows) if (one.waits) one.begin({ ...about.view, camera: null });
  if (JSON.stringify([whole, box]) !== JSON.stringify([about.whole, about.box])) {
    for (const one of windows) {
      for (const layer of about.view.layers) {
        if (!one.view.layers.some((other) => other.object === layer.object)) one.view.layers.push(layer);
      }
      one.fit();
      one.redraw();
    }
  }
  speak();
}

/** Something was carried out: the present state is shown, wherever one is. */
async function carried() {
  if (look.waiting) { clearTimeout(look.waiting); await look(); }
  const now = state.sources.findIndex((source) => source.name.startsWith("now: "));
  if (about && now >= 0 && current.source !== now && !shownNow) { $("source").value = now; await switched(); }
  shownNow = shownNow || now >= 0;
}

function run() {
  const { run: found } = state;
  $("run").hidden = !found;
  if (!found) return;
  const key = found.running ? "running" : found.state;
  const text = say(`state_${key}`, { host: found.host, step: found.step });
  const n = frames().length;
  $("run-state").textContent = `${found.script && `${found.script}: `}${text.startsWith("state_") ? found.state : text}, ${say("frames", { n })}`;
  for (const id of ["stop", "checkpoint"]) $(id).disabled = !found.running;
  const far = found.progress;
  $("progress").hidden = $("far").hidden = $("log-line").hidden = !far;
  if (!far) return;
  const part = far.script_part ?? far.part, left = far.script_left ?? far.left;
  if (part === null) $("progress").removeAttribute("value"); else $("progress").value = Math.min(part, 1);
  $("far").textContent = [say("at_step", { step: far.step, command: far.command }),
    ...(part === null ? [] : [`${(100 * part).toFixed(1)} %`]), ...(left === null ? [] : [say("left", { time: duration(left) })])].join(" · ");
  $("log-line").textContent = far.line;
}

function duration(seconds) {
  const all = Math.round(seconds), two = (n) => String(n).padStart(2, "0");
  const [h, m, s] = [Math.floor(all / 3600), Math.floor(all / 60) % 60, all % 60];
  return h ? `${h}:${two(m)}:${two(s)}` : m ? `${m}:${two(s)}` : `${s} s`;
}

/** What is said where there is no picture yet: why, and what to do. */
function waiting() {
  const empty = !windows.some((one) => one.shown), found = state.waiting ?? {};
  $("waiting").hidden = !empty;
  if (!empty) return;
  const kind = state.sources.length ? (found.drawing ? "wait_drawing" : "wait_picture") : `wait_${found.kind ?? "picture"}`;
  $("waiting").dataset.kind = kind;
  $("waiting").querySelector("p").textContent = say(kind, { ...found });
  const line = state.run?.progress?.line || (found.kind === "empty" ? "" : desk.lastLine());
  $("waiting").querySelector("pre").textContent = line;
  $("waiting").querySelector("pre").hidden = !line;
}

async function tell(what) {
  if (what === "stop" && !confirm(say("stop_sure"))) return;
  try { told((await json("tell", { what })).said); } catch (error) { complain(error); }
}

function sources() {
  const names = state.sources.map((source, k) => [k, source.name]);
  const same = [...$("source").options].map((o) => o.text).join() === names.map(([, name]) => name).join();
  if (!same) options($("source"), names, current?.source ?? 0);
}

// ---- files -----------------------------------------------------------------------------------------------------------

const asked_file = (format) => ask("file", { source: current.source, frame: current.frame, format, label: chosen,
  view: { ...current.view, camera: current.box }, fps: Number($("speed").value) });

async function save(format) {
  if (format === "clip") { await clip(); return; }
  const step = current.shown?.header.step ?? 0;
  const name = format === "mv" ? "view.mv" : `view_${String(step).padStart(10, "0")}.${format}`;
  told(say("saving", { name }));
  try {
    const blob = await (await asked_file(format)).blob();
    charts.offered(blob, name);
    told(say("saved", { name, size: Math.ceil(blob.size / 1024) }));
  } catch (error) { complain(error); }
}

/** The picture as it is saved: with axes, bar and title. It is made while the browser waits, as the click allows that. */
async function clip() {
  told(say("saving", { name: say("save_clip") }));
  const made = asked_file("png").then((response) => response.blob());
  try {
    await navigator.clipboard.write([new ClipboardItem({ "image/png": made })]);
    told(say("copied"));
  } catch {
    try { await made; told(say("not_copied_picture"), true); } catch (error) { complain(error); }
  }
}

async function open(file) {
  try {
    const view = await json("view", { view: JSON.parse(await file.text()) });
    const { camera } = view;
    current.view = { ...view, camera: null };
    if (camera) {
      const [w, h] = current.size;
      current.camera = { x: (camera[0] + camera[1]) / 2, y: (camera[2] + camera[3]) / 2,
        width: Math.max(camera[1] - camera[0], (camera[3] - camera[2]) * w / h) };
    }
    tree(); controls();
    current.redraw();
    told(say("opened", { name: file.name }));
  } catch (error) { told(`${file.name}: ${error.message}`, true); }
}

// ---- the page --------------------------------------------------------------------------------------------------------

const dark = matchMedia("(prefers-color-scheme: dark)");
function paint() {
  document.documentElement.dataset.theme = theme === "auto" ? (dark.matches ? "dark" : "light") : theme;
  $("theme").textContent = say(`theme_${theme}`);
  charts.speak();
  for (const one of windows) one.redraw();
}

function speak() {
  words.translate();
  $("language").textContent = say("language");
  $("language").lang = say("language_code");
  options($("save"), [["", say("save_as")], ...(about ? [...about.files, "clip"] : []).map((kind) => [kind, say(`save_${kind}`)])], "");
  if (about) {
    options($("add"), [["", say("add")], ...about.order.filter((name) => name in about.objects).map((name) => [name, say(name)])], "");
    tree(); controls(); run();
  }
  label_play();
  desk.speak();
  waiting();
  paint();
}

async function begin() {
  about = await json("about", { source: 0, frame: -1 });
  const { camera, step } = about.view, view = { ...about.view, camera: null };
  const list = state.sources[0].frames;
  const found = step === null ? -1 : list.findIndex(([one]) => one === step);
  windows = [new Window(view, { x: 0, y: 0, width: 1 }, 0, found < 0 ? list.length - 1 : found)];
  $("windows").append(windows[0].root);
  windows[0].fit();
  if (camera) windows[0].camera = { x: (camera[0] + camera[1]) / 2, y: (camera[2] + camera[3]) / 2, width: camera[1] - camera[0] };
  choose(windows[0]);
  speak();
  if (about.box) told(say("keys_space"), false, true);
  connect();
  new ResizeObserver(() => { for (const one of windows) one.resized(); }).observe($("windows"));
}

async function switched() {
  const source = Number($("source").value);
  try {
    about = { ...await json("about", { source, frame: -1 }), colours: about.colours };
    current.source = source;
    current.frame = frames().length - 1;
    current.begin({ ...about.view, camera: null });
    current.fit();
    speak();
    current.redraw();
  } catch (error) { complain(error); }
}

function key(event) {
  if (event.target.matches("input:not([type=checkbox]):not([type=range]), select, textarea") || event.ctrlKey || event.metaKey) return;
  const step = current ? current.camera.width / 10 : 0;
  const pan = (dx, dy) => { current.camera.x += dx; current.camera.y += dy; moved(current); };
  const turn = (a, b) => looked(current, turned(directionOf(current.view.eye), a, b));
  const mode = (name) => { $("mode").value = name; modes(); };
  const actions = {
    "+": () => zoomed(current, 0.8), "=": () => zoomed(current, 0.8), "-": () => zoomed(current, 1.25),
    0: () => { current.fit(); moved(current); }, ",": () => go(current.frame - 1), ".": () => go(current.frame + 1),
    " ": play, q: () => mode("query"), d: () => mode("distance"), m: () => mode("move"), Escape: () => mode("move"),
    ArrowLeft: () => pan(-step, 0), ArrowRight: () => pan(step, 0), ArrowUp: () => pan(0, step), ArrowDown: () => pan(0, -step),
  };
  if (about?.box && event.shiftKey) {
    const by = Math.PI / 12;
    Object.assign(actions, { ArrowLeft: () => turn(-by, 0), ArrowRight: () => turn(by, 0), ArrowUp: () => turn(0, by),
      ArrowDown: () => turn(0, -by) });
  }
  const onSlider = event.target.matches("input[type=range]") && event.key.startsWith("Arrow");
  const onButton = event.target.matches("button, input") && event.key === " ";
  if (!current || !(event.key in actions) || onSlider || onButton) return;
  event.preventDefault();
  actions[event.key]();
}

function modes() {
  for (const one of windows) { one.root.dataset.mode = $("mode").value; one.points = []; one.marks(); }
}

function connect() {
  const on = (id, event, action) => $(id).addEventListener(event, action);
  on("field", "change", () => { change({ field: $("field").value, limits: null, colour: "" }); properties(); $("low").value = $("high").value = ""; });
  for (const id of ["low", "high"]) on(id, "change", limits);
  on("full", "change", () => { change({ limits: $("full").checked ? "full" : null }); properties(); });
  for (const id of ["log", "edges"]) on(id, "change", () => change({ [id]: $(id).checked }));
  for (const id of ["colours", "vectors"]) on(id, "change", () => change({ [id]: $(id).value }));
  for (const id of ["opacity", "size", "arrows"]) on(id, "input", () => { if ($(id).value) change({ [id]: Number($(id).value) }); });
  const own = () => change($("own").checked ? { colour: $("colour").value, field: "" } : { colour: "" });
  on("own", "change", () => { own(); properties(); });
  on("colour", "input", () => { $("own").checked = true; own(); $("field").value = ""; });
  on("apply", "click", () => change({ filter: $("filter").value }));
  on("filter", "keydown", (event) => {
    if (event.key === "Enter" && !event.shiftKey) { event.preventDefault(); change({ filter: $("filter").value }); }
  });
  on("filter", "input", () => { $("filter").rows = Math.min(8, $("filter").value.split("\n").length); });
  on("deformed", "change", () => { current.view.deformed = Number($("deformed").value) || 0; current.redraw(); });
  on("eye", "change", () => { looked(current, $("eye").value); current.fit(); moved(current); });
  on("section", "change", () => cut($("section").value.trim()));
  on("cut-axis", "change", cutAlong);
  on("cut", "input", cutAt);
  on("slice", "change", () => {
    const text = current.view.section.replace(/^slice /, "");
    if (text) cut(`${$("slice").checked ? "slice " : ""}${text}`);
  });
  on("title", "change", () => { current.view.title = $("title").value; current.redraw(); });
  on("up", "click", () => shift(-1));
  on("down", "click", () => shift(1));
  on("rename", "click", rename);
  on("remove", "click", remove);
  on("add", "change", add);
  on("fit", "click", () => { current.fit(); moved(current); });
  on("split", "change", split);
  on("linked", "change", () => moved(current));
  on("mode", "change", modes);
  on("source", "change", switched);
  on("save", "change", () => { const kind = $("save").value; $("save").value = ""; if (kind) save(kind); });
  on("open", "click", () => $("file").click());
  on("file", "change", () => { if ($("file").files[0]) open($("file").files[0]); $("file").value = ""; });
  on("copy", "click", copy);
  on("first", "click", () => go(0));
  on("back", "click", () => go(current.frame - 1));
  on("play", "click", play);
  on("next", "click", () => go(current.frame + 1));
  on("last", "click", () => go(frames().length - 1));
  on("slider", "input", () => go(Number($("slider").value)));
  on("stop", "click", () => tell("stop"));
  on("checkpoint", "click", () => tell("save"));
  document.addEventListener("keydown", key);
}

/** The panel beside the model is there, or folded away; on a small screen it lies over the model, and begins folded. */
function fold(on) {
  document.body.classList.toggle("folded", on);
  $("fold").setAttribute("aria-expanded", !on);
}

function menu(on) {
  document.body.classList.toggle("menu", on);
  $("menu").setAttribute("aria-expanded", on);
}

function connectFirst() {
  const on = (id, event, action) => $(id).addEventListener(event, action);
  const narrow = matchMedia("(max-width: 700px)");
  fold(narrow.matches || words.kept("hpcdem.folded") === "yes");
  narrow.addEventListener("change", () => fold(narrow.matches));
  on("fold", "click", () => {
    fold(!document.body.classList.contains("folded"));
    if (!narrow.matches) words.keep("hpcdem.folded", document.body.classList.contains("folded") ? "yes" : "no");
  });
  on("menu", "click", () => menu(!document.body.classList.contains("menu")));
  on("stage", "pointerdown", () => { menu(false); if (narrow.matches) fold(true); });
  on("message", "click", () => told(""));
  charts.begin(complain);
  on("language", "click", () => { words.choose(words.current() === "en" ? "zh" : "en"); speak(); });
  on("theme", "click", () => {
    theme = { auto: "light", light: "dark", dark: "auto" }[theme] ?? "auto";
    words.keep("hpcdem.theme", theme);
    paint();
  });
  dark.addEventListener("change", paint);
}

words.begin();
theme = words.kept("hpcdem.theme") ?? "auto";
speak();
connectFirst();
told(say("keys"), false, true);
look();
desk.begin(complain, carried);
