// Charts of what a run records: any history over any other, several in one, and the charts of its script (curves.py).

import { ask } from "./server.js";
import { say } from "./words.js";

const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
const INKS = {  // of curves: six that the colour-blind tell apart, then the same with dashes
  light: ["#0f6f70", "#c1561b", "#3d55b8", "#93358d", "#7a6a00", "#202020"],
  dark: ["#55c2b8", "#f0a35e", "#9fb2ff", "#e495dd", "#d6cb55", "#e9e6de"],
};
const FONT = 'system-ui, "Noto Sans", "Noto Sans CJK SC", "Microsoft YaHei", sans-serif';

let complain = () => {};
let there = { records: [], charts: [] };
let presets = [];
let wish = null;  // { chart } or { x, y }
let told = null;  // what the server drew of it
let step = null;  // of the picture
let known = "";

async function json(name, content) { return (await ask(name, content)).json(); }

/** A number with so many digits after the point that neighbours on an axis differ. */
function marked(value, by) {
  if (Math.abs(value) < by / 2) return "0";
  if (Math.abs(value) >= 1e6 || by < 1e-4) return value.toExponential(2).replace(/\.?0*e\+?/, "e");
  return value.toFixed(Math.max(0, -Math.floor(Math.log10(by) + 1e-9)));
}

/** Round values within a range, at least so many: steps of 1, 2 or 5 times a power of ten. */
export function ticks(low, high, least) {
  let decade = 10 ** Math.ceil(Math.log10(high - low));
  for (;; decade /= 10) {
    for (const by of [5 * decade, 2 * decade, decade]) {
      const first = Math.ceil(low / by - 1e-9), last = Math.floor(high / by + 1e-9);
      if (last - first + 1 >= least) return { by, places: Array.from({ length: last - first + 1 }, (_, k) => (first + k) * by) };
    }
  }
}

function range(columns) {
  let low = Infinity, high = -Infinity;
  for (const column of columns) for (const v of column) if (v !== null) { if (v < low) low = v; if (v > high) high = v; }
  if (!(low <= high)) return [0, 1];
  const air = Math.max(Math.abs(low), Math.abs(high)) || 1;
  if (high - low < 1e-9 * air) return [low - air / 2, high + air / 2];  // a line, but for rounding
  return [low, high];
}

function element(name, attributes = {}, text = "") {
  const e = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) e.setAttribute(key, value);
  if (text) e.textContent = text;
  return e;
}

const OWN = ["time", "step", "load", "shortening"];  // titles that are not the user's
const named = (part) => {
  const title = OWN.includes(part.title) ? say(`chart_${part.title}`) : part.title;
  return part.shown ? `${title} (${part.shown})` : title;
};

/** The chart as SVG. look: width, height, font [pixels], dark, ground (a colour, or none), step (of the picture). */
export function figure(shown, look) {
  const { width, height, font, dark = false } = look;
  const ink = dark ? "#e9e6de" : "#1c2528", faint = dark ? "#9ba8ac" : "#59666b", grid = dark ? "#2b3438" : "#e3dfd5";
  const svg = element("svg", { xmlns: SVG, viewBox: `0 0 ${width} ${height}`, width, height, "font-family": FONT,
    "font-size": font, role: "img" });
  if (look.ground) svg.append(element("rect", { width, height, fill: look.ground }));
  const units = [...new Set(shown.curves.map((curve) => curve.unit))].slice(0, 2);
  const curves = shown.curves.filter((curve) => units.includes(curve.unit));
  const several = curves.length > 1, em = 0.62 * font;
  const xs = range(curves.map((curve) => curve.x)).map((v) => v / shown.x.size);
  const sides = units.map((unit) => {
    const own = curves.filter((curve) => curve.unit === unit), size = own[0].size;
    const [low, high] = range(own.map((curve) => curve.y)).map((v) => v / size), air = 0.04 * (high - low);
    const span = [low - air, high + air];
    const { by, places } = ticks(...span, height > 25 * font ? 5 : 4);
    const words = places.map((v) => marked(v, by));
    const title = own.length === 1 ? named(own[0]) : shown.y_title ?? (own[0].shown || "");
    return { unit, size, span, places, words, title, room: Math.max(...words.map((word) => word.length)) * em + 2.3 * font };
  });
  const left = sides[0].room, right = width - (sides[1]?.room ?? 1.2 * font);
  const rows = several ? Math.ceil(curves.length / Math.max(1, Math.floor((right - left) / (15 * font)))) : 0;
  const top = 0.8 * font + 1.4 * font * rows, bottom = height - 3.1 * font;
  const x = (v) => left + (right - left) * (v - xs[0]) / (xs[1] - xs[0]);
  const across = ticks(...xs, right - left > 30 * font ? 5 : 4);
  for (const v of across.places) {
    svg.append(element("line", { x1: x(v), x2: x(v), y1: top, y2: bottom, stroke: grid }));
    svg.append(element("text", { x: x(v), y: bottom + 1.2 * font, "text-anchor": "middle", fill: faint, "data-tick": "x" }, marked(v, across.by)));
  }
  svg.append(element("text", { x: (left + right) / 2, y: height - 0.5 * font, "text-anchor": "middle", fill: ink, "data-axis": "x" }, named(shown.x)));
  sides.forEach((side, n) => {
    side.y = (v) => bottom - (bottom - top) * (v - side.span[0]) / (side.span[1] - side.span[0]);
    side.places.forEach((v, k) => {
      if (!n) svg.append(element("line", { x1: left, x2: right, y1: side.y(v), y2: side.y(v), stroke: grid }));
      svg.append(element("text", { x: n ? right + 0.4 * font : left - 0.4 * font, y: side.y(v) + 0.35 * font, fill: faint,
        "text-anchor": n ? "start" : "end", "data-tick": "y" }, side.words[k]));
    });
    const at = n ? width - 0.5 * font : 1.1 * font, middle = (top + bottom) / 2;
    svg.append(element("text", { x: at, y: middle, transform: `rotate(-90 ${at} ${middle})`, "text-anchor": "middle", fill: ink, "data-axis": "y" }, side.title));
  });
  svg.append(element("path", { d: `M${left} ${top}V${bottom}H${right}${sides[1] ? `V${top}` : ""}`, fill: "none", stroke: faint }));
  const inks = INKS[dark ? "dark" : "light"], columns = Math.max(1, Math.floor((right - left) / (15 * font)));
  curves.forEach((curve, n) => {
    const side = sides[units.indexOf(curve.unit)], stroke = inks[n % inks.length], y = (v) => side.y(v / side.size);
    let d = "", pen = false;
    curve.x.forEach((v, k) => {
      if (v === null || curve.y[k] === null) { pen = false; return; }
      d += `${pen ? "L" : "M"}${x(v / shown.x.size).toFixed(1)} ${y(curve.y[k]).toFixed(1)}`;
      pen = true;
    });
    const dashes = n >= inks.length ? { "stroke-dasharray": "6 3" } : {};
    svg.append(element("path", { d, fill: "none", stroke, "stroke-width": 0.14 * font, "stroke-linejoin": "round", "data-curve": n, ...dashes }));
    const now = look.step ?? -1, last = curve.step.findLastIndex((one) => one <= now);
    if (now >= 0 && last >= 0 && curve.step[last] >= 0 && curve.x[last] !== null && curve.y[last] !== null) {
      svg.append(element("circle", { cx: x(curve.x[last] / shown.x.size), cy: y(curve.y[last]), r: 0.34 * font, fill: stroke, stroke: ink, "data-now": n }));
    }
    if (several) {
      const at = [left + (n % columns) * (right - left) / columns, 0.9 * font + 1.4 * font * Math.floor(n / columns)];
      svg.append(element("line", { x1: at[0], x2: at[0] + 1.4 * font, y1: at[1] - 0.3 * font, y2: at[1] - 0.3 * font, stroke, "stroke-width": 0.2 * font, ...dashes }));
      svg.append(element("text", { x: at[0] + 1.8 * font, y: at[1], fill: ink, "data-name": n }, sides.length > 1 ? named(curve) : curve.title));
    }
  });
  svg.setAttribute("aria-label", say("chart", { name: `${curves.map((curve) => curve.title).join(", ")} / ${named(shown.x)}` }));
  return svg;
}

// ---- what is drawn ---------------------------------------------------------------------------------------------------

const quoted = (name) => (name.includes("'") ? `"${name}"` : `'${name}'`);

/** Those of the select: what a laboratory draws, charts of the script, each history over time. */
function choices() {
  const value = $("history").value;
  const option = (key, text) => new Option(text, key);
  const group = (name, options) => {
    const one = document.createElement("optgroup");
    one.label = say(name);
    one.append(...options);
    return options.length ? [one] : [];
  };
  $("history").replaceChildren(option("", say("none")),
    ...group("chart_ready", presets.map((one, n) => option(`preset ${n}`, say(`chart_${one.kind}`, { name: one.chart?.replace(/\.csv$/, "") })))),
    ...group("chart_over_time", there.records.map(([name, title, label]) => option(`history ${name}`, title === label ? label : `${name}: ${title}`))));
  $("history").value = [...$("history").options].some((one) => one.value === value) ? value : "";
  if (wish && !$("history").value) own();
  const ready = $("history").querySelector("option[value^=preset]");
  $("chart-ready").hidden = !ready || Boolean(wish);
  if (ready) { $("chart-ready").textContent = ready.text; $("chart-ready").value = ready.value; }
  columns();
}

/** The chart is none of the list. */
function own() {
  if (![...$("history").options].some((one) => one.value === "own")) $("history").append(new Option(say("chart_own"), "own"));
  $("history").value = "own";
}

/** What stands along x, and the curves, to be chosen one by one. */
function columns() {
  const all = [["time", say("chart_time")], ["step", say("chart_step")], ...there.records.map(([name, , label]) => [quoted(name), label])];
  const x = wish?.x ?? "time", y = wish?.y ?? [];
  if (wish?.x && !all.some(([key]) => key === x)) all.push([x, x]);
  $("chart-x").replaceChildren(...all.map(([key, text]) => new Option(text, key)));
  $("chart-x").value = x;
  $("chart-columns").hidden = !there.records.length || !$("history").value || wish?.chart !== undefined;
  const pairs = [...all.slice(2, 2 + there.records.length), ...y.filter((one) => !there.records.some(([name]) => quoted(name) === one)).map((one) => [one, one])];
  $("chart-y").replaceChildren(...pairs.map(([key, text]) => {
    const line = document.createElement("label"), box = document.createElement("input");
    line.className = "check";
    box.type = "checkbox";
    box.checked = y.includes(key);
    box.dataset.column = key;
    box.addEventListener("change", () => change({ y: box.checked ? [...wish.y, key] : wish.y.filter((one) => one !== key) }));
    line.append(box, text);
    return line;
  }));
  $("chart-count").textContent = y.length === 1 ? pairs.find(([key]) => key === y[0])[1].split("=")[0] : say("chart_some", { n: y.length });
}

function change(values) {
  wish = { ...wish, ...values };
  own();
  load();
}

async function choose() {
  const [kind, ...rest] = $("history").value.split(" "), name = rest.join(" ");
  if (kind === "own") return;
  if (kind === "preset") {  // which end is above the other is known once there are numbers
    try { presets = (await json("presets", {})).presets; } catch (error) { complain(error); return; }
  }
  wish = { preset: () => { const { kind: _, ...one } = presets[name]; return one; },
    history: () => ({ x: "time", y: [quoted(name)] }) }[kind]?.() ?? null;
  await load();
  $("chart").scrollIntoView({ block: "nearest" });
}

async function load() {
  columns();
  if (wish) $("chart-ready").hidden = true;
  const mine = wish;
  if (!wish || (wish.y && !wish.y.length)) { told = null; draw(); return; }
  try {
    const found = await json("curves", wish);
    if (mine !== wish) return;
    told = found;
    $("chart-said").textContent = "";
    draw();
  } catch (error) {
    $("chart-said").textContent = error.message;
    if (!$("chart-dialog").open) complain(error);
  }
}

function draw() {
  const small = $("chart"), dark = document.documentElement.dataset.theme === "dark";
  small.hidden = !told;
  if (!told) { small.replaceChildren(); return; }
  const width = Math.max(220, $("charts").clientWidth || 280);
  small.replaceChildren(figure(told, { width, height: Math.round(0.62 * width), font: 10, dark, step }));
  small.setAttribute("aria-label", small.firstChild.getAttribute("aria-label"));
  if (!$("chart-dialog").open) return;
  const box = $("chart-figure");
  box.replaceChildren(figure(told, { width: Math.max(300, box.clientWidth), height: Math.max(220, box.clientHeight), font: 13, dark, step }));
  if (document.activeElement !== $("chart-x-text")) $("chart-x-text").value = wish.x ?? told.x.title;
  if (document.activeElement !== $("chart-y-text")) $("chart-y-text").value = (wish.y ?? told.curves.map((curve) => curve.title)).join("\n");
  $("chart-y-text").rows = Math.min(6, Math.max(1, $("chart-y-text").value.split("\n").length));
  $("chart-x-text").disabled = $("chart-y-text").disabled = wish.chart !== undefined;
}

function texts() {
  const y = $("chart-y-text").value.split("\n").map((line) => line.trim()).filter(Boolean);
  change({ x: $("chart-x-text").value.trim(), y });
}

// ---- files -----------------------------------------------------------------------------------------------------------

const name = () => (wish.chart?.replace(/\.csv$/, "") ?? told.curves.map((curve) => curve.title).join("_")).replace(/[^\p{L}\p{N}]+/gu, "_").slice(0, 60) || "chart";
const picture = () => figure(told, { width: 960, height: 600, font: 16, ground: "#ffffff" });

export function offered(blob, file) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = file;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

async function saved(kind) {
  try {
    if (kind === "csv") offered(await (await ask("curves", { ...wish, format: "csv" })).blob(), `${name()}.csv`);
    const text = new XMLSerializer().serializeToString(picture());
    if (kind === "svg") offered(new Blob([text], { type: "image/svg+xml" }), `${name()}.svg`);
    if (kind === "png") {
      const image = new Image(1920, 1200), canvas = document.createElement("canvas");
      image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
      await image.decode();
      [canvas.width, canvas.height] = [1920, 1200];
      canvas.getContext("2d").drawImage(image, 0, 0, 1920, 1200);
      offered(await new Promise((done) => { canvas.toBlob(done, "image/png"); }), `${name()}.png`);
    }
  } catch (error) { $("chart-said").textContent = error.message; }
}

// ---- the page --------------------------------------------------------------------------------------------------------

/** What the server said about histories; running: they grow. */
export async function update(histories, running) {
  const now = JSON.stringify(histories);
  if (now !== known) {
    known = now;
    there = histories;
    try { presets = (await json("presets", {})).presets; } catch (error) { complain(error); }
    choices();
  }
  if (wish && running) await load();
}

/** The picture is that of another step. */
export function moment(now) { if (now !== step) { step = now; draw(); } }

/** In the language and the theme of now. */
export function speak() { if (known) choices(); draw(); }

export function begin(complained) {
  complain = complained;
  const on = (id, event, action) => $(id).addEventListener(event, action);
  on("history", "change", choose);
  on("chart-ready", "click", () => { $("history").value = $("chart-ready").value; choose(); });
  on("chart-x", "change", () => change({ x: $("chart-x").value }));
  on("chart", "click", () => { $("chart-dialog").showModal(); draw(); });
  on("chart-close", "click", () => $("chart-dialog").close());
  for (const id of ["chart-x-text", "chart-y-text"]) on(id, "change", texts);
  on("chart-x-text", "keydown", (event) => { if (event.key === "Enter") { event.preventDefault(); texts(); } });
  for (const kind of ["csv", "png", "svg"]) on(`chart-${kind}`, "click", () => saved(kind));
  new ResizeObserver(draw).observe($("chart-figure"));
}
