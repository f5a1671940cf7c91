// The page: what is wanted (table, sliders), asking for it while it changes, showing the answer.

import { drawCurve } from "./curve.js";
import { Packing } from "./packing.js";
import { Refusal, ask, askSpecimen } from "./server.js";
import * as words from "./words.js";

const { say } = words;
const $ = (id) => document.getElementById(id);
const LARGEST_FILE = 64 * 1024;
const OVERTAKEN_AFTER = 500; // ms after which a request under way is given up for a newer one
const SMOOTH = 0.2; // s that a picture may take while a slider moves; more, and it is drawn with fewer grains
const CORNERS = ["triangle", "quadrilateral", "pentagon"];
const ICONS = {
  circle: "M14 8A6 6 0 1 1 2 8A6 6 0 1 1 14 8Z", ellipse: "M15 8A7 4 0 1 1 1 8A7 4 0 1 1 15 8Z",
  triangle: "M8 2L14.500 13H1.500Z", quadrilateral: "M3 3H13V13H3Z", pentagon: "M8 1.500L14.500 6.500L12 14H4L1.500 6.500Z",
};
const FIELDS = {
  number: { step: 1, log: true }, slenderness: { step: 0.05 }, void_ratio: { step: 0.01 },
  l_over_d: { step: 0.05, shapes: ["ellipse"] }, deviation: { step: 0.5, shapes: CORNERS },
  roundness: { step: 0.01, shapes: CORNERS },
};

let start; // what the server began with: request, limits
let state; // the request: rows [[d, P]] as typed, and a value per field
let specimen = null; // the last answer
let packing;
let failed = ""; // the sentence shown, as the server said it
const controls = {}; // name -> { row, range, exact }

// -- what is wanted ---------------------------------------------------------------------------------------------

function number(value, digits = 4) {
  if (!Number.isFinite(value)) return "–";
  return Number(value.toPrecision(digits)).toLocaleString(words.current() === "zh" ? "zh-CN" : "en-US", {
    maximumFractionDigits: 6,
  });
}

function sliders() {
  const place = $("sliders");
  place.replaceChildren();
  for (const [name, field] of Object.entries(FIELDS)) {
    const row = document.createElement("div");
    row.className = "slider";
    row.dataset.field = name;
    const label = document.createElement("label");
    label.htmlFor = name;
    label.innerHTML = "<span></span> <i></i>";
    const range = Object.assign(document.createElement("input"), { type: "range", id: name });
    const exact = Object.assign(document.createElement("input"), { type: "number", id: `${name}-exact`, className: "exact" });
    row.append(label, range, exact);
    place.append(row);
    controls[name] = { row, label, range, exact };
    range.addEventListener("input", () => set(name, ofSlider(name, Number(range.value)), range));
    exact.addEventListener("input", () => set(name, exact.value === "" ? NaN : Number(exact.value), exact));
    exact.step = field.log ? 1 : "any";
    range.addEventListener("pointerdown", () => { dragging = true; });
    for (const end of ["pointerup", "pointercancel", "change"]) range.addEventListener(end, letGo);
  }
  const row = document.createElement("div");
  row.className = "slider";
  row.dataset.field = "seed";
  const label = document.createElement("label");
  label.htmlFor = "seed";
  label.innerHTML = "<span></span> <i></i>";
  const dice = Object.assign(document.createElement("button"), { type: "button", className: "dice", id: "dice" });
  const exact = Object.assign(document.createElement("input"), { type: "number", id: "seed", className: "exact", step: 1 });
  dice.dataset.t = "dice";
  dice.addEventListener("click", () => set("seed", Math.floor(Math.random() * 1e6), dice));
  exact.addEventListener("input", () => set("seed", exact.value === "" ? NaN : Number(exact.value), exact));
  row.append(label, dice, exact);
  place.append(row);
  controls.seed = { row, label, exact };
}

function limits(name) {
  const [low, high] = start.limits[name];
  return name === "deviation" ? start.limits.deviations[state.shape] ?? [low, high] : [low, high];
}

// Sliders of whole steps; the number of grains by its logarithm.
function toSlider(name, value) {
  const [low, high] = limits(name);
  if (!FIELDS[name].log) return value;
  return (1000 * Math.log(value / low)) / Math.log(high / low);
}

function ofSlider(name, place) {
  const [low, high] = limits(name);
  if (!FIELDS[name].log) return Number(place.toFixed(6));
  const value = low * (high / low) ** (place / 1000);
  return Math.min(high, Math.max(low, Number(value.toPrecision(2))));
}

function choices(id, names) {
  const group = $(id);
  group.replaceChildren(...names.map((name) => {
    const label = document.createElement("label");
    const input = Object.assign(document.createElement("input"), { type: "radio", name: id, value: name, id: `${id}-${name}` });
    const face = document.createElement("span");
    if (ICONS[name]) {
      face.innerHTML = `<svg viewBox="0 0 16 16" aria-hidden="true"><path d="${ICONS[name]}"/></svg>`;
    }
    const text = document.createElement("span");
    text.dataset.t = name;
    text.className = "text";
    face.append(text);
    label.append(input, face);
    input.addEventListener("change", () => set(id, name, input));
    return label;
  }));
}

function set(name, value, source) {
  state[name] = value;
  if (name === "shape" && CORNERS.includes(value)) state.deviation = Math.min(state.deviation, limits("deviation")[1]);
  fill(source);
  change();
}

// Controls say what the state says; the one being used is left alone.
function fill(source) {
  for (const id of ["shape", "placement"]) {
    for (const input of $(id).querySelectorAll("input")) input.checked = input.value === state[id];
  }
  for (const [name, { row, label, range, exact }] of Object.entries(controls)) {
    const field = FIELDS[name];
    row.hidden = Boolean(field?.shapes && !field.shapes.includes(state.shape));
    const [low, high] = limits(name);
    if (range) {
      Object.assign(range, field.log ? { min: 0, max: 1000, step: 1 } : { min: low, max: high, step: field.step });
      if (range !== source && Number.isFinite(state[name])) range.value = toSlider(name, state[name]);
      range.setAttribute("aria-valuetext", `${number(state[name])} ${say(`${name}_unit`)}`);
    }
    if (exact !== source) exact.value = Number.isFinite(state[name]) ? state[name] : "";
    Object.assign(exact, { min: low, max: high });
    exact.setAttribute("aria-label", say("exactly", { name: say(name) }));
    label.children[0].textContent = say(name);
    label.children[1].textContent = say(`${name}_unit`);
  }
}

// -- the table --------------------------------------------------------------------------------------------------

function table() {
  $("rows").replaceChildren(...state.rows.map((_, k) => line(k)));
  results();
}

function line(k) {
  const row = document.createElement("tr");
  const cell = (child, kind = "") => {
    const td = Object.assign(document.createElement("td"), { className: kind });
    if (child) td.append(child);
    row.append(td);
    return td;
  };
  cell(Object.assign(document.createElement("span"), { className: "swatch" }));
  for (const column of [0, 1]) {
    const input = Object.assign(document.createElement("input"), { type: "text", inputMode: "decimal", value: state.rows[k][column] });
    input.dataset.cell = `${k}-${column}`;
    input.autocomplete = "off";
    input.spellcheck = false;
    input.setAttribute("aria-label", say(column ? "finer_of" : "size_of", { row: k + 1 }));
    input.addEventListener("input", () => { state.rows[k][column] = input.value; change(); });
    input.addEventListener("keydown", (e) => {
      const to = { ArrowUp: k - 1, ArrowDown: k + 1, Enter: k + 1 }[e.key];
      const other = document.querySelector(`[data-cell="${to}-${column}"]`);
      if (other) { e.preventDefault(); other.focus(); other.select(); }
    });
    input.addEventListener("paste", (e) => {
      const text = e.clipboardData.getData("text");
      if (text.trim().split(/\s+/).length > 2) { e.preventDefault(); load(text); }
    });
    cell(input);
  }
  cell(null, "number reached");
  cell(null, "number grains");
  const remove = Object.assign(document.createElement("button"), { type: "button", className: "remove", textContent: "×" });
  remove.setAttribute("aria-label", say("remove_row", { row: k + 1 }));
  remove.disabled = state.rows.length < 2;
  remove.addEventListener("click", () => {
    state.rows.splice(k, 1);
    table();
    document.querySelector(`[data-cell="${Math.min(k, state.rows.length - 1)}-0"]`)?.focus();
    change();
  });
  cell(remove);
  return row;
}

// Colour, count and percentage reached beside the rows they belong to (by size: rows may stand in either order).
function results() {
  [...$("rows").rows].forEach((row, k) => {
    const size = Number(state.rows[k][0]);
    const found = specimen?.classes.find((c) => Math.abs(c.size - size) <= 1e-9 * size);
    row.cells[0].firstChild.style.background = found ? found.colour : "";
    row.cells[3].textContent = found ? found.reached.toFixed(1) : "";
    const count = row.cells[4];
    count.replaceChildren(found ? number(found.count, 9) : "");
    count.classList.toggle("none", found?.count === 0 && found.needed > 0);
    if (found?.count === 0 && found.needed > 0) {
      const button = Object.assign(document.createElement("button"), { type: "button", className: "need" });
      button.textContent = say("need", { n: number(found.needed, 12) });
      button.title = say("need_title", { n: number(found.needed, 12) });
      button.disabled = found.needed > start.limits.number[1];
      button.addEventListener("click", () => set("number", found.needed, button));
      count.replaceChildren(button);
    }
  });
}

function load(text) {
  const lines = text.split(/\r?\n/).map((l) => l.trim()).filter((l) => l && !l.startsWith("#"));
  state.rows = lines.map((l) => {
    const [size = "", ...rest] = l.split(/\s+/);
    return [size, rest.join(" ")];
  });
  if (!state.rows.length) state.rows = [["", ""]];
  table();
  change();
}

async function open(file) {
  if (!file) return;
  if (file.size > LARGEST_FILE) return complain(say("bad_file", { name: file.name }));
  try { load(await file.text()); } catch (error) { complain(say("no_file", { why: error.message })); }
}

// -- asking -----------------------------------------------------------------------------------------------------

let dragging = false, wanted = null, running = null, timer = 0, serial = 0, shown = 0;

function request() {
  const values = Object.fromEntries([...Object.keys(controls), "shape", "placement"].map((name) => [name, state[name]]));
  return { ...start.request, ...values, rows: state.rows };
}

function change() {
  wanted = request();
  pump();
}

// A slider comes to rest: what was drawn with fewer grains is drawn with all.
function letGo() {
  if (!dragging) return;
  dragging = false;
  change();
}

// What is asked for while a slider moves: fewer grains where all would take longer than a picture may.
function coarser(content) {
  const each = specimen ? specimen.seconds / specimen.number : 0;
  const enough = Math.max(200, Math.round(SMOOTH / each));
  return dragging && each > 0 && content.number > enough ? { ...content, number: enough } : content;
}

// One request at a time; the newest replaces those that wait, and one under way that takes long.
function pump() {
  clearTimeout(timer);
  if (!wanted) return;
  const rest = running ? running.began + OVERTAKEN_AFTER - performance.now() : 0;
  if (rest > 0) { timer = setTimeout(pump, rest); return; }
  running?.stop.abort();
  const mine = { serial: ++serial, began: performance.now(), stop: new AbortController() };
  const content = coarser(wanted);
  mine.coarse = content.number !== wanted.number;
  [running, wanted] = [mine, null];
  setTimeout(busy, 150);
  if (!specimen) setTimeout(busy, 3000);
  askSpecimen(content, mine.stop.signal)
    .then((answer) => { if (mine.serial > shown) { shown = mine.serial; arrived(answer, mine); } })
    .catch((error) => {
      if (error.name === "AbortError" || error.superseded || mine.serial < serial) return;
      complain(error instanceof Refusal ? error.message : say("no_server", { why: error.message }));
    })
    .finally(() => {
      if (running === mine) running = null;
      busy();
      pump();
    });
}

function busy() {
  const age = running ? performance.now() - running.began : 0;
  const text = age > 2900 && !specimen ? say("first") : age > 140 ? say("busy") : "";
  if ($("busy").textContent !== text) $("busy").textContent = text;
  $("packing").setAttribute("aria-busy", String(Boolean(running)));
}

function arrived(answer, mine) {
  specimen = answer;
  specimen.waited = performance.now() - mine.began;
  failed = "";
  $("error").hidden = true;
  specimen.coarse = mine.coarse;
  $("stale").hidden = true;
  $("coarse").hidden = !mine.coarse;
  $("coarse").textContent = say("coarse", { n: number(specimen.number, 9) });
  $("stage").classList.remove("stale");
  for (const input of document.querySelectorAll("[aria-invalid]")) input.removeAttribute("aria-invalid");
  packing.show(specimen);
  render();
}

// The sentence, and the last drawing paled: it is not what the table and sliders say.
function complain(message) {
  failed = message;
  const row = /^table:(\d+): /.exec(message);
  const box = $("error");
  box.textContent = row ? say("row", { row: row[1], text: message.slice(row[0].length) }) : message;
  box.hidden = false;
  $("stale").hidden = !specimen;
  $("stage").classList.toggle("stale", Boolean(specimen));
  for (const input of document.querySelectorAll("[aria-invalid]")) input.removeAttribute("aria-invalid");
  if (row) for (const column of [0, 1]) document.querySelector(`[data-cell="${row[1] - 1}-${column}"]`)?.setAttribute("aria-invalid", "true");
  for (const [name, { exact }] of Object.entries(controls)) {
    if (new RegExp(`^(angle )?${name}\\b`).test(message)) exact.setAttribute("aria-invalid", "true");
  }
}

// -- showing ----------------------------------------------------------------------------------------------------

function render() {
  if (!specimen) return;
  results();
  drawCurve($("plot"), specimen.classes, $("soil").checked);
  facts();
  $("notes").textContent = specimen.notes.join(" ");
  $("notes").hidden = !specimen.notes.length;
  $("canvas").setAttribute("aria-label", say("picture", {
    n: number(specimen.placed, 9), shape: say(specimen.shape), w: number(specimen.box.width), h: number(specimen.box.height),
  }));
  document.documentElement.dataset.shown = shown; // for scripts that wait for a drawing
}

function facts() {
  const s = specimen;
  const shares = s.classes.filter((c) => c.needed > 0); // the last size may have no share
  const asked = (v) => (v === null ? "" : say("fact_asked", { v: number(v, 3) }));
  const rows = [
    ["fact_number", number(s.placed, 9), s.placed < s.number ? say("fact_of", { n: number(s.number, 9) }) : ""],
    ["fact_classes", `${shares.filter((c) => c.count).length} / ${shares.length}`, ""],
    ["fact_need", number(s.needed, 12), ""],
    ["fact_void", number(s.void_ratio.reached, 3), say("fact_void_target", { e: number(s.void_ratio.target, 3) })],
    ["fact_box", `${number(s.box.width)} × ${number(s.box.height)}`, "mm"],
    ["fact_solid", number(s.solid_area), "mm²"],
    ["fact_cu", number(s.cu.reached ?? NaN, 3), asked(s.cu.target)],
    ["fact_cc", number(s.cc.reached ?? NaN, 3), asked(s.cc.target)],
    ["fact_time", `${number(1e3 * s.seconds, 3)} ms`, say("fact_time_of", { draw: `${number(packing.took, 2)} ms` })],
  ];
  if (s.extent[3] > 1.001 * s.box.height) rows.splice(5, 0, ["fact_height", number(s.extent[3]), "mm"]);
  $("facts").replaceChildren(...rows.map(([name, value, more], k) => {
    const div = document.createElement("div");
    div.dataset.fact = name;
    const [dt, dd, small] = ["dt", "dd", "small"].map((tag) => document.createElement(tag));
    dt.textContent = say(name);
    small.textContent = more;
    dd.append(`${value} `, small);
    div.append(dt, dd);
    return div;
  }));
}

// -- files ------------------------------------------------------------------------------------------------------

// A line per content, a button per file: figures come in several formats.
function outputs() {
  const groups = new Map([[say("all_files"), ["specimen.zip"]]]);
  for (const name of specimen?.files ?? []) {
    const text = meaning(name);
    groups.set(text, [...(groups.get(text) ?? []), name]);
  }
  groups.set(say("file_table"), ["grading.txt"]);
  $("list").replaceChildren(...[...groups].map(([text, names]) => {
    const item = document.createElement("li");
    const what = document.createElement("span");
    what.append(text, Object.assign(document.createElement("small"), { textContent: names.join(", ") }));
    const buttons = Object.assign(document.createElement("span"), { className: "tools" });
    buttons.append(...names.map((name) => saver(name, names.length > 1 ? name.split(".").pop().toUpperCase() : say("save"))));
    item.append(what, buttons);
    return item;
  }));
  $("command").textContent = specimen?.command ?? "";
}

function saver(name, text) {
  const button = Object.assign(document.createElement("button"), { type: "button", textContent: text });
  if (name.endsWith(".zip")) button.className = "main";
  button.dataset.file = name;
  button.setAttribute("aria-label", `${say("save")} ${name}`);
  button.disabled = Boolean(failed);
  button.addEventListener("click", () => save(name, button));
  return button;
}

function meaning(name) {
  const known = [[/_full\.dat$/, "file_full"], [/_plain\.dat$/, "file_plain"], [/\.dat$/, "file_specimen"], [/\.(xyr|clumps)$/, "file_bodies"],
    [/\.csv$/, "file_grading"], [/^grading\./, "file_curve"], [/^packing\./, "file_packing"],
    [/^sizes\./, "file_histogram"], [/^deposit\.py$/, "file_deposit"], [/^biaxial\.py$/, "file_biaxial"],
    [/\.json$/, "file_summary"]];
  const found = known.find(([pattern]) => pattern.test(name));
  return found ? say(found[1]) : "";
}

async function save(name, button) {
  button.disabled = true;
  $("said").textContent = say("saving", { name });
  try {
    const content = name === "grading.txt"
      ? new Blob([state.rows.map(([d, p]) => `${d} ${p}\n`).join("")], { type: "text/plain" })
      : await (await ask("file", { ...request(), file: name })).blob();
    const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(content), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60e3);
    $("said").textContent = say("saved", { name, size: number(content.size / 1024, 3) });
  } catch (error) {
    $("said").textContent = error instanceof Refusal ? error.message : say("no_server", { why: error.message });
  }
  button.disabled = false;
}

async function copy() {
  try {
    await navigator.clipboard.writeText($("command").textContent);
    $("said").textContent = say("copied");
  } catch { $("said").textContent = say("not_copied"); }
}

// -- language and theme -----------------------------------------------------------------------------------------

const dark = matchMedia("(prefers-color-scheme: dark)");
let theme = "auto";

function paint() {
  document.documentElement.dataset.theme = theme === "auto" ? (dark.matches ? "dark" : "light") : theme;
  $("theme").textContent = say(`theme_${theme}`);
  packing?.redraw();
}

function speak() {
  words.translate();
  $("language").textContent = say("language");
  $("language").lang = say("language_code");
  fill();
  table();
  if (failed) complain(failed);
  paint();
  render();
}

function look(shownSpecimen) {
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(`--${name}`).trim();
  return { colours: shownSpecimen.classes.map((c) => c.colour), ink: colour("ink"), edge: colour("edge"), card: colour("card") };
}

function tip(e) {
  const dots = packing.dots;
  const k = e.buttons ? -1 : packing.at(e.offsetX * dots, e.offsetY * dots);
  const box = $("tip");
  box.hidden = k < 0;
  if (k < 0) return;
  box.textContent = say("tip", { d: number(specimen.classes[specimen.arrays.kind[k]].size), n: k + 1 });
  const room = $("stage").clientWidth - box.offsetWidth - 14;
  box.style.left = `${Math.min(e.offsetX + 14, room)}px`;
  box.style.top = `${Math.max(4, e.offsetY - 34)}px`;
}

// -- beginning --------------------------------------------------------------------------------------------------

function copyOf(values) {
  return { ...values, rows: values.rows.map((row) => [...row]) };
}

async function begin() {
  words.begin();
  theme = words.kept("hpcdem.theme") ?? "auto";
  start = await (await fetch("start")).json();
  state = copyOf(start.request);
  $("soil").checked = start.falling;
  choices("shape", start.limits.shapes);
  choices("placement", start.limits.placements);
  sliders();
  packing = new Packing($("canvas"), look, () => {
    const time = document.querySelector("[data-fact=fact_time] small");
    if (time) time.textContent = say("fact_time_of", { draw: `${number(packing.took, 2)} ms` });
    document.documentElement.dataset.drawn = shown;
  });
  speak();

  $("add").addEventListener("click", () => {
    state.rows.push(["", ""]);
    table();
    document.querySelector(`[data-cell="${state.rows.length - 1}-0"]`).focus();
  });
  $("reset").addEventListener("click", () => { state = copyOf(start.request); fill(); table(); change(); });
  $("open").addEventListener("click", () => $("file").click());
  $("file").addEventListener("change", () => { open($("file").files[0]); $("file").value = ""; });
  document.addEventListener("dragover", (e) => e.preventDefault());
  document.addEventListener("drop", (e) => { e.preventDefault(); open(e.dataTransfer.files[0]); });
  $("soil").addEventListener("change", render);
  $("language").addEventListener("click", () => { words.choose(words.current() === "en" ? "zh" : "en"); speak(); });
  $("theme").addEventListener("click", () => {
    theme = { auto: "light", light: "dark", dark: "auto" }[theme] ?? "auto";
    words.keep("hpcdem.theme", theme);
    paint();
  });
  dark.addEventListener("change", paint);
  new ResizeObserver(() => { if (specimen) drawCurve($("plot"), specimen.classes, $("soil").checked); }).observe($("plot"));
  $("fit-box").addEventListener("click", () => packing.fit("box"));
  $("fit-all").addEventListener("click", () => packing.fit("all"));
  $("nearer").addEventListener("click", () => packing.zoom(1.4));
  $("farther").addEventListener("click", () => packing.zoom(1 / 1.4));
  $("canvas").addEventListener("pointermove", tip);
  $("canvas").addEventListener("pointerleave", () => { $("tip").hidden = true; });
  $("output").addEventListener("click", () => { outputs(); $("said").textContent = ""; $("files").showModal(); });
  $("close").addEventListener("click", () => $("files").close());
  $("copy").addEventListener("click", copy);
  change();
}

begin().catch((error) => complain(say("no_server", { why: error.message })));
