// Commands that are typed, and scripts that are edited, checked and run: there with `hpcdem view --run` only (desk.py).

import { ask } from "./server.js";
import { say } from "./words.js";

const $ = (id) => document.getElementById(id);
const QUICK = 250, SLOW = 1000;  // ms between two looks at the console, at work and not
const MOST = 5000;  // lines shown

let complain = () => {};
let changed = () => {};
let last = 0;
let state = { busy: false, alive: false, language: "pcdc" };
let asked = [];  // lines typed before
let place = 0;
let opened = { name: "", stamp: null, text: "" };
let wrong = null;  // line

async function json(name, content) { return (await ask(name, content)).json(); }
const guarded = (action) => async (...given) => { try { await action(...given); } catch (error) { complain(error); } };

// ---- the console -----------------------------------------------------------------------------------------------------

async function look() {
  try {
    const told = await json("console", { since: last });
    if (told.last < last) $("output").replaceChildren();
    last = told.last;
    for (const [text, kind] of told.lines) {
      const line = document.createElement("div");
      line.className = kind;
      line.textContent = kind === "asked" ? `> ${text}` : text;
      $("output").append(line);
    }
    while ($("output").childElementCount > MOST) $("output").firstChild.remove();
    if (told.lines.length) $("output").scrollTop = $("output").scrollHeight;
    const ended = state.busy && !told.busy;
    state = told;
    show();
    if (ended) changed();
  } catch (error) { complain(error); }
  setTimeout(look, state.busy ? QUICK : SLOW);
}

function show() {
  $("tongue").value = state.language;
  $("tongue").disabled = state.busy;
  $("prompt").textContent = `${state.language}>`;
  $("interrupt").disabled = !state.busy;
  for (const id of ["script-run", "script-part"]) $(id).disabled = state.busy;
  $("desk-state").textContent = say(state.busy ? "desk_busy" : state.alive ? "desk_ready" : "desk_off");
  document.body.dataset.desk = state.busy ? "busy" : state.alive ? "ready" : "off";
}

async function carryOut(text, name = "") {
  const told = await json("say", { text, name, language: state.language });
  state = { ...state, busy: true, language: told.language };
  show();
}

async function typed() {
  const text = $("input").value;
  if (!text.trim() || state.busy) return;
  await carryOut(text);
  if (asked.at(-1) !== text) asked.push(text);
  place = asked.length;
  $("input").value = "";
}

function recall(by) {
  place = Math.min(Math.max(place + by, 0), asked.length);
  $("input").value = asked[place] ?? "";
}

// ---- words that fit --------------------------------------------------------------------------------------------------

async function complete(field) {
  const before = field.value.slice(0, field.selectionStart), line = before.slice(before.lastIndexOf("\n") + 1);
  const language = field === $("text") && opened.language ? opened.language : state.language;
  const { words, last: length } = await json("complete", { line, language });
  const put = (word) => {
    const at = field.selectionStart;
    field.setRangeText(`${word} `, at - length, at, "end");
    field.focus();
    close();
    field.dispatchEvent(new Event("input"));
  };
  if (words.length === 1) { put(words[0]); return; }
  const list = $("words");
  list.replaceChildren(...words.map((word) => {
    const item = document.createElement("li");
    item.role = "option";
    item.tabIndex = -1;
    item.textContent = word;
    item.addEventListener("mousedown", (event) => { event.preventDefault(); put(word); });
    return item;
  }));
  list.hidden = !words.length;
  list.put = put;
  mark(0);
}

const close = () => { $("words").hidden = true; };

function mark(number) {
  const items = [...$("words").children];
  if (!items.length) return;
  $("words").number = (number + items.length) % items.length;
  items.forEach((item, k) => item.setAttribute("aria-selected", k === $("words").number));
  items[$("words").number].scrollIntoView({ block: "nearest" });
}

/** Whether a key was for the list of words. */
function chosen(event) {
  const list = $("words");
  if (list.hidden) return false;
  const actions = {
    ArrowDown: () => mark(list.number + 1), ArrowUp: () => mark(list.number - 1), Escape: close,
    Enter: () => list.put(list.children[list.number].textContent), Tab: () => list.put(list.children[list.number].textContent),
  };
  if (!(event.key in actions)) { close(); return false; }
  event.preventDefault();
  actions[event.key]();
  return true;
}

// ---- scripts ---------------------------------------------------------------------------------------------------------

const dirty = () => $("text").value !== opened.text;
const sure = () => !dirty() || confirm(say("script_lost", { name: opened.name || say("script_unnamed") }));

async function list(name) {
  const { names } = await json("scripts", {});
  const shown = name && !names.includes(name) ? [name, ...names] : names;
  $("script").replaceChildren(...["", ...shown].map((one) => new Option(one || say("script_unnamed"), one)));
  $("script").value = name;
}

function put(found) {
  opened = found;
  $("text").value = found.text;
  wrong = null;
  $("check-result").textContent = "";
  lines();
}

async function open(name) {
  put(name ? await json("read", { name }) : { name: "", text: "", stamp: null });
  await list(name);
  if (name) await check();
}

async function save(as = false) {
  let { name, stamp } = opened;
  if (as || !name) {
    name = prompt(say("script_name"), name || "script.sc");
    if (!name) return false;
    if (name !== opened.name) stamp = null;
  }
  const text = $("text").value;
  const told = await json("write", { name, text, stamp });
  opened = { ...opened, ...told, text };
  await list(name);
  await check();
  return true;
}

async function check() {
  const text = $("text").value;
  const told = await json("check", { name: opened.name || "script.sc", text });
  if (text !== $("text").value) return false;  // it was changed meanwhile
  opened.language = told.language;
  wrong = told.line;
  $("check-result").className = told.problem ? "bad" : "";
  $("check-result").textContent = told.problem ? (told.line ? `${told.line}: ${told.problem}` : told.problem)
    : told.summary.split("\n")[0];
  lines();
  return !told.problem;
}

async function runAll() {
  if ((dirty() || !opened.name) && !await save()) return;
  if (!await check()) return;
  await carryOut(opened.text, opened.name);
  tab("console");
}

async function runPart() {
  const field = $("text");
  let [from, to] = [field.selectionStart, field.selectionEnd];
  from = field.value.lastIndexOf("\n", from - 1) + 1;
  const end = field.value.indexOf("\n", Math.max(to - 1, from));
  to = end < 0 ? field.value.length : end;
  const text = field.value.slice(from, to);
  if (!text.trim()) return;
  if (opened.language && opened.language !== "python") state.language = opened.language;
  await carryOut(text);
}

function replaceAll() {
  const find = $("find").value;
  if (!find) return;
  const count = $("text").value.split(find).length - 1;
  $("text").value = $("text").value.replaceAll(find, () => $("replace").value);
  lines();
  $("check-result").textContent = say("replaced", { n: count });
}

function findNext() {
  const field = $("text"), what = $("find").value;
  if (!what) return;
  let at = field.value.indexOf(what, field.selectionEnd);
  if (at < 0) at = field.value.indexOf(what);
  if (at < 0) { $("check-result").textContent = say("not_found", { what }); return; }
  field.focus();
  field.setSelectionRange(at, at + what.length);
  field.scrollTop = Math.max(0, (field.value.slice(0, at).split("\n").length - 4) * lineHeight());
}

/** Put # before the lines of the selection, or take it away. */
function comment() {
  const field = $("text");
  const from = field.value.lastIndexOf("\n", field.selectionStart - 1) + 1;
  const end = field.value.indexOf("\n", Math.max(field.selectionEnd - 1, from));
  const to = end < 0 ? field.value.length : end;
  const rows = field.value.slice(from, to).split("\n");
  const all = rows.every((row) => !row.trim() || row.startsWith("#"));
  field.setRangeText(rows.map((row) => all ? row.replace(/^# ?/, "") : row.trim() ? `# ${row}` : row).join("\n"), from, to, "select");
  lines();
}

const lineHeight = () => parseFloat(getComputedStyle($("text")).lineHeight);

function lines() {
  const count = $("text").value.split("\n").length;
  const numbers = $("numbers-of-lines");
  numbers.replaceChildren(...Array.from({ length: count }, (_, k) => {
    const one = document.createElement("div");
    one.textContent = k + 1;
    if (k + 1 === wrong) { one.className = "bad"; one.title = $("check-result").textContent; }
    return one;
  }));
  numbers.hidden = $("wrap").checked;
  numbers.scrollTop = $("text").scrollTop;
  document.body.dataset.wrong = wrong ?? "";
}

function editorKey(event) {
  if (chosen(event)) return;
  const control = event.ctrlKey || event.metaKey;
  const field = $("text");
  if (control && event.key === " ") { event.preventDefault(); guarded(complete)(field); }
  else if (control && event.key === "s") { event.preventDefault(); guarded(save)(); }
  else if (control && event.key === "Enter") { event.preventDefault(); guarded(runPart)(); }
  else if (control && event.key === "/") { event.preventDefault(); comment(); }
  else if (control && event.key === "f") { event.preventDefault(); $("find").focus(); }
}

function consoleKey(event) {
  if (chosen(event)) return;
  const actions = { Enter: guarded(typed), ArrowUp: () => recall(-1), ArrowDown: () => recall(1), Tab: () => guarded(complete)($("input")) };
  if (event.ctrlKey && event.key === "c" && !String(getSelection())) { event.preventDefault(); guarded(interrupt)(); return; }
  if (!(event.key in actions) || event.shiftKey) return;
  event.preventDefault();
  actions[event.key]();
}

const interrupt = () => json("interrupt", {});

async function restart(language) {
  if (state.alive && !confirm(say("restart_sure"))) { show(); return; }
  await json("restart", { language });
  state = { ...state, busy: true, language };
  show();
}

function tab(name) {
  for (const one of ["console", "editor"]) {
    $(one).hidden = one !== name;
    $(`tab-${one}`).setAttribute("aria-selected", one === name);
  }
  close();
  $(name === "console" ? "input" : "text").focus();
}

function drag(event) {
  const desk = $("desk"), from = event.clientY, height = desk.clientHeight;
  const move = (now) => { desk.style.height = `${Math.max(120, height + from - now.clientY)}px`; };
  const stop = () => { removeEventListener("pointermove", move); removeEventListener("pointerup", stop); };
  addEventListener("pointermove", move);
  addEventListener("pointerup", stop);
}

/** complained: shows an error; ready: called when something was carried out. Nothing happens unless the page may run
 * programs. */
export async function begin(complained, ready) {
  complain = complained;
  changed = ready;
  if (!(await (await fetch("desk")).json()).run) return;
  $("desk-toggle").hidden = $("desk").hidden = false;
  $("desk-toggle").setAttribute("aria-expanded", true);
  const on = (id, event, action) => $(id).addEventListener(event, action);
  on("desk-toggle", "click", () => {
    $("desk").hidden = !$("desk").hidden;
    $("desk-toggle").setAttribute("aria-expanded", !$("desk").hidden);
  });
  on("desk-edge", "pointerdown", drag);
  for (const one of ["console", "editor"]) on(`tab-${one}`, "click", () => tab(one));
  on("input", "keydown", consoleKey);
  on("text", "keydown", editorKey);
  on("text", "input", () => { wrong = null; lines(); });
  on("text", "scroll", () => { $("numbers-of-lines").scrollTop = $("text").scrollTop; });
  on("input", "blur", close);
  on("text", "blur", close);
  on("clear", "click", () => $("output").replaceChildren());
  on("interrupt", "click", guarded(interrupt));
  on("restart", "click", guarded(() => restart(state.language)));
  on("tongue", "change", guarded(() => restart($("tongue").value)));
  on("script", "change", guarded(async () => { if (sure()) await open($("script").value); else $("script").value = opened.name; }));
  on("script-new", "click", guarded(async () => { if (sure()) await open(""); }));
  on("script-save", "click", guarded(() => save()));
  on("script-save-as", "click", guarded(() => save(true)));
  on("script-check", "click", guarded(check));
  on("script-run", "click", guarded(runAll));
  on("script-part", "click", guarded(runPart));
  on("replace-all", "click", replaceAll);
  on("find", "keydown", (event) => { if (event.key === "Enter") { event.preventDefault(); findNext(); } });
  on("wrap", "change", () => { $("text").wrap = $("wrap").checked ? "soft" : "off"; lines(); });
  addEventListener("beforeunload", (event) => { if (dirty()) event.preventDefault(); });
  try {
    const { first } = await json("scripts", {});
    await open(first);
    if (first) tab("editor");
  } catch (error) { complain(error); }
  look();
}

/** Texts that the page has written itself, in the language of now. */
export function speak() { if (!$("desk-toggle").hidden) show(); }
