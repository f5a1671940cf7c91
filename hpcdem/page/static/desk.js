// Commands that are typed, and scripts that are edited, checked and run: there with `hpcdem view --run` only (desk.py).

import { ask } from "./server.js";
import { say } from "./words.js";

const $ = (id) => document.getElementById(id);
const QUICK = 250, SLOW = 1000;  // ms between two looks at the console, at work and not
const MOST = 5000;  // lines shown
const STRETCH = 700;  // ms; what is typed within them is undone at once

let complain = () => {};
let changed = () => {};
let last = 0;
let state = { busy: false, alive: false, language: "pcdc" };
let asked = [];  // lines typed before
let place = 0;
let papers = [];  // scripts that are open
let seen = [];  // of these, the one or two on show
let opened = null;  // the one that keys and buttons are for

async function json(name, content) { return (await ask(name, content)).json(); }
const guarded = (action) => async (...given) => { try { await action(...given); } catch (error) { complain(error); } };

// ---- the console -----------------------------------------------------------------------------------------------------

let lastSaid = "";

/** What the console said last, while it is at work. */
export const lastLine = () => (state.busy ? lastSaid : "");

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
    const said = told.lines.findLast(([, kind]) => kind === "said");
    if (said) lastSaid = said[0];
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

function type(text) {
  $("input").value = text;
  grow();
}

/** As high as what stands in it. */
function grow() { $("input").rows = Math.min(10, $("input").value.split("\n").length); }

let entered = [];  // ends of what was entered and not yet judged

/** Enter: what is whole is carried out, a block of Python goes on, as at Python's own prompt. The next line is there at once:
 * what is typed while the server judges belongs into it, another Enter too. */
async function enter() {
  const field = $("input"), last = !field.value.slice(field.selectionEnd).includes("\n");
  if (!field.value.trim() || state.busy) return;
  if (!last) { goOn(field); return; }
  entered.push(field.value.length);
  goOn(field, field.value.length);
  if (entered.length > 1) return;
  try {
    while (entered.length) await judge(field);
  } finally { entered = []; }
}

async function judge(field) {
  const text = field.value.slice(0, entered[0]);
  const { whole } = await json("whole", { text, language: state.language });
  if (!field.value.startsWith(`${text}\n`)) { entered = []; return; }  // it was changed meanwhile
  entered.shift();
  if (!whole) return;
  entered = [];  // what follows waits until this is done
  await carryOut(text.replace(/\s+$/, text.includes("\n") ? "\n" : ""));
  if (asked.at(-1) !== text) asked.push(text);
  place = asked.length;
  type(field.value.slice(text.length + 1).trimStart());
}

/** Another line, as far in as this one, farther behind a colon. */
function goOn(field, at = field.selectionStart) {
  const line = field.value.slice(field.value.lastIndexOf("\n", at - 1) + 1, at);
  const into = /^[ \t]*/.exec(line)[0] + (line.trimEnd().endsWith(":") ? "    " : "");
  field.setRangeText(`\n${into}`, at, field.selectionEnd > at ? field.selectionEnd : at, "end");
  grow();
}

function recall(by) {
  place = Math.min(Math.max(place + by, 0), asked.length);
  type(asked[place] ?? "");
}

/** Whether up and down leave what is typed: on its first, or its last line. */
function outside(field, up) {
  const { value, selectionStart, selectionEnd } = field;
  return selectionStart === selectionEnd && !(up ? value.slice(0, selectionStart) : value.slice(selectionEnd)).includes("\n");
}

// ---- words that fit --------------------------------------------------------------------------------------------------

let questions = 0;

async function complete(field) {
  const now = () => JSON.stringify([field.value, field.selectionStart, field.selectionEnd, field.id]);
  const mine = ++questions, before = field.value.slice(0, field.selectionStart), then = now();
  const language = field === $("text") && opened.language ? opened.language : state.language;
  const { words, last: length } = await json("complete", { line: before.slice(before.lastIndexOf("\n") + 1), language });
  if (mine !== questions || now() !== then) return;  // the answer is about another line
  const put = (word) => {
    close();
    if (now() !== then) return;
    field.setRangeText(`${word} `, before.length - length, before.length, "end");
    field.focus();
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

/** A script that is open: what of it is on the disk (saved, stamp), and what the check said. */
class Paper {
  constructor({ name = "", text = "", stamp = null }) {
    Object.assign(this, { name, stamp, saved: text, language: null, wrong: null, said: "", bad: false });
    Object.assign(this, { before: { text, from: 0, to: 0 }, older: [], newer: [], at: 0 });
    this.root = document.createElement("div");
    this.root.className = "paper";
    this.numbers = document.createElement("pre");
    this.numbers.setAttribute("aria-hidden", true);
    this.area = document.createElement("textarea");
    Object.assign(this.area, { spellcheck: false, autocapitalize: "off", value: text, wrap: $("wrap").checked ? "soft" : "off" });
    this.area.addEventListener("keydown", editorKey);
    this.area.addEventListener("input", () => { this.noted(); this.wrong = null; close(); lines(this); tabs(); });
    this.area.addEventListener("scroll", () => { this.numbers.scrollTop = this.area.scrollTop; });
    this.area.addEventListener("blur", close);
    this.area.addEventListener("focus", () => { if (opened !== this) turn(this); });
    this.root.append(this.numbers, this.area);
    $("papers").append(this.root);
    papers.push(this);
  }

  get dirty() { return this.area.value !== this.saved; }

  get title() { return this.name || say("script_unnamed"); }

  get now() { return { text: this.area.value, from: this.area.selectionStart, to: this.area.selectionEnd }; }

  /** Something was changed: what is typed in a row is undone at once. Browsers have one row for all fields of a page. */
  noted() {
    if (performance.now() - this.at > STRETCH || !this.older.length) this.older.push(this.before);
    Object.assign(this, { before: this.now, newer: [], at: performance.now() });
  }

  /** Undo, or take that back. */
  back(from, to) {
    if (!from.length) return;
    to.push(this.now);
    this.before = from.pop();
    this.area.value = this.before.text;
    this.area.setSelectionRange(this.before.from, this.before.to);
    this.at = 0;
    this.wrong = null;
    lines(this);
    tabs();
  }

  /** Put a text in place of another, as if it were typed. */
  replace(from, to, text) {
    this.at = 0;
    this.area.setRangeText(text, from, to, "select");
    this.area.focus();
    this.noted();
    this.at = 0;
  }

  /** Nothing that could be lost. */
  get blank() { return !this.name && !this.area.value; }
}

const dirty = () => papers.some((one) => one.dirty);

/** Make a script the one that keys and buttons are for; it takes the place of that one unless it is on show. */
function turn(paper) {
  if (!seen.includes(paper)) seen = seen.length ? seen.map((one) => (one === opened ? paper : one)) : [paper];
  opened = paper;
  for (const one of papers) {
    one.root.hidden = !seen.includes(one);
    one.root.style.order = seen.indexOf(one);
    one.root.classList.toggle("current", one === paper);
    one.area.id = one === paper ? "text" : "";
    one.numbers.id = one === paper ? "numbers-of-lines" : "";
    one.area.setAttribute("aria-label", `${say("text")}: ${one.title}`);
  }
  result();
  lines(paper);
  tabs();
}

/** A tab for each script that is open, with a mark where something is not saved. */
function tabs() {
  $("papers-open").replaceChildren(...papers.map((one) => {
    const button = document.createElement("button");
    button.type = "button";
    button.role = "tab";
    button.setAttribute("aria-selected", one === opened);
    button.textContent = `${one.dirty ? "● " : ""}${one.title}`;
    button.addEventListener("click", () => { turn(one); one.area.focus(); });
    button.addEventListener("auxclick", (event) => { if (event.button === 1) guarded(shut)(one); });
    return button;
  }));
  $("script-save-all").disabled = !dirty();
  document.body.dataset.dirty = dirty();
}

function panes() {
  const count = $("panes").value === "1" ? 1 : 2;
  seen = seen.includes(opened) ? [opened, ...seen.filter((one) => one !== opened)].slice(0, count) : [opened];
  if (seen.length < count) seen.push(papers.find((one) => !seen.includes(one)) ?? new Paper({}));
  $("papers").dataset.panes = $("panes").value;
  turn(opened);
  for (const one of seen) lines(one);
}

async function list() {
  const { names } = await json("scripts", {});
  const name = opened.name, shown = name && !names.includes(name) ? [name, ...names] : names;
  $("script").replaceChildren(...["", ...shown].map((one) => new Option(one || say("script_unnamed"), one)));
  $("script").value = name;
}

async function open(name) {
  const there = name ? papers.find((one) => one.name === name) : null;
  const before = opened;
  turn(there ?? new Paper(name ? await json("read", { name }) : {}));
  if (before?.blank && before !== opened && name) drop(before);
  await list();
  if (name && !there) await check();
}

async function save(as = false, paper = opened) {
  let { name, stamp } = paper;
  if (as || !name) {
    name = prompt(say("script_name"), name || "script.sc");
    if (!name) return false;
    if (papers.some((one) => one !== paper && one.name === name)) { complain(new Error(say("script_open_twice", { name }))); return false; }
    if (name !== paper.name) stamp = null;
  }
  const text = paper.area.value;
  Object.assign(paper, await json("write", { name, text, stamp }), { saved: text });
  tabs();
  await list();
  await check(paper);
  return true;
}

/** One after the other; a script that cannot be saved keeps its mark, and the others are saved. */
async function saveAll() {
  let problem = null;
  for (const one of papers.filter((paper) => paper.dirty)) {
    try { await save(false, one); } catch (error) { problem ??= error; }
  }
  if (problem) throw problem;
}

async function rename() {
  if (!opened.name) { await save(true); return; }
  const to = prompt(say("script_rename_to", { name: opened.name }), opened.name);
  if (!to || to === opened.name) return;
  Object.assign(opened, await json("rename", { name: opened.name, to, stamp: opened.stamp }));
  turn(opened);
  await list();
}

/** Close a script; what is not saved is asked about. */
async function shut(paper = opened) {
  if (paper.dirty) {
    const what = await question(say("script_closing", { name: paper.title }), ["save_and_close", "drop_changes", "cancel"]);
    if (what === "cancel" || (what === "save_and_close" && !await save(false, paper))) return;
  }
  drop(paper);
  await list();
}

function drop(paper) {
  papers = papers.filter((one) => one !== paper);
  paper.root.remove();
  if (seen.includes(paper)) {
    seen = seen.filter((one) => one !== paper);
    const next = papers.find((one) => !seen.includes(one)) ?? seen[0] ?? new Paper({});
    if (!seen.includes(next)) seen.push(next);
    if (seen.length < 2 && $("panes").value !== "1") seen.push(new Paper({}));
    if (opened === paper) opened = next;
  }
  turn(opened);
}

/** Ask with buttons; the name of the one that was pressed. */
function question(text, names) {
  const box = $("question");
  $("question-text").textContent = text;
  return new Promise((done) => {
    box.querySelector(".tools").replaceChildren(...names.map((name) => {
      const button = document.createElement("button");
      button.type = "button";
      button.dataset.answer = name;
      button.textContent = say(name);
      button.addEventListener("click", () => { box.onclose = null; box.close(); done(name); });
      return button;
    }));
    box.onclose = () => done("cancel");
    box.showModal();
  });
}

function result() {
  $("check-result").className = opened.bad ? "bad" : "";
  $("check-result").textContent = opened.said;
}

async function check(paper = opened) {
  const text = paper.area.value;
  const told = await json("check", { name: paper.name || "script.sc", text });
  if (text !== paper.area.value) return false;  // it was changed meanwhile
  const said = told.problem ? (told.line ? `${told.line}: ${told.problem}` : told.problem) : told.summary.split("\n")[0];
  Object.assign(paper, { language: told.language, wrong: told.line, said, bad: Boolean(told.problem) });
  if (paper === opened) result();
  lines(paper);
  return !told.problem;
}

async function runAll() {
  if ((opened.dirty || !opened.name) && !await save()) return;
  if (!await check()) return;
  await carryOut(opened.saved, opened.name);
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

/** Something of the text was changed by a button. */
function changedText(said = null) {
  opened.wrong = null;
  if (said !== null) Object.assign(opened, { said, bad: false });
  result();
  lines(opened);
  tabs();
}

function replaceAll() {
  const find = $("find").value;
  if (!find) return;
  const field = $("text"), count = field.value.split(find).length - 1;
  if (count) opened.replace(0, field.value.length, field.value.replaceAll(find, () => $("replace").value));
  changedText(say("replaced", { n: count }));
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

/** Put # before the lines of the selection (on), or take it away; without a word whichever is the other. */
function comment(on = null) {
  const field = $("text");
  const from = field.value.lastIndexOf("\n", field.selectionStart - 1) + 1;
  const end = field.value.indexOf("\n", Math.max(field.selectionEnd - 1, from));
  const to = end < 0 ? field.value.length : end;
  const rows = field.value.slice(from, to).split("\n");
  const add = on ?? !rows.every((row) => !row.trim() || row.startsWith("#"));
  const text = rows.map((row) => add ? row.trim() ? `# ${row}` : row : row.replace(/^# ?/, "")).join("\n");
  opened.replace(from, to, text);
  changedText();
}

const lineHeight = () => parseFloat(getComputedStyle($("text")).lineHeight);

function lines(paper) {
  const count = paper.area.value.split("\n").length, { numbers, wrong } = paper;
  numbers.replaceChildren(...Array.from({ length: count }, (_, k) => {
    const one = document.createElement("div");
    one.textContent = k + 1;
    if (k + 1 === wrong) { one.className = "bad"; one.title = paper.said; }
    return one;
  }));
  numbers.hidden = $("wrap").checked;
  numbers.scrollTop = paper.area.scrollTop;
  if (paper === opened) document.body.dataset.wrong = wrong ?? "";
}

function editorKey(event) {
  if (chosen(event)) return;
  const control = event.ctrlKey || event.metaKey;
  const field = $("text");
  if (control && event.key === " ") { event.preventDefault(); guarded(complete)(field); }
  else if (control && event.key.toLowerCase() === "z") {
    event.preventDefault();
    if (event.shiftKey) opened.back(opened.newer, opened.older); else opened.back(opened.older, opened.newer);
  } else if (control && event.key === "y") { event.preventDefault(); opened.back(opened.newer, opened.older); }
  else if (control && event.key.toLowerCase() === "s") { event.preventDefault(); guarded(event.shiftKey ? saveAll : save)(); }
  else if (control && event.key === "Enter") { event.preventDefault(); guarded(runPart)(); }
  else if (control && event.key === "/") { event.preventDefault(); comment(); }
  else if (control && event.key === "f") {
    event.preventDefault();
    $("editor").classList.add("more");
    $("find").focus();
  }
}

function consoleKey(event) {
  if (chosen(event)) return;
  const field = $("input");
  const actions = { Enter: guarded(enter), ArrowUp: () => recall(-1), ArrowDown: () => recall(1), Tab: () => guarded(complete)(field) };
  if (event.ctrlKey && event.key === "c" && !String(getSelection()) && field.selectionStart === field.selectionEnd) {
    event.preventDefault(); guarded(interrupt)(); return;
  }
  if (event.key === "Enter" && event.shiftKey) { event.preventDefault(); goOn(field); return; }
  if (!(event.key in actions) || event.shiftKey) return;
  if (event.key.startsWith("Arrow") && !outside(field, event.key === "ArrowUp")) return;
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

let picked = false;  // whether a tab was chosen, before the first script is there

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
  for (const one of ["console", "editor"]) on(`tab-${one}`, "click", () => { picked = true; tab(one); });
  on("input", "keydown", consoleKey);
  on("input", "input", () => { close(); grow(); });
  on("input", "blur", close);
  on("clear", "click", () => $("output").replaceChildren());
  on("interrupt", "click", guarded(interrupt));
  on("restart", "click", guarded(() => restart(state.language)));
  on("tongue", "change", guarded(() => restart($("tongue").value)));
  on("script", "change", guarded(() => open($("script").value)));
  on("script-new", "click", guarded(() => open("")));
  on("script-save", "click", guarded(() => save()));
  on("script-save-all", "click", guarded(saveAll));
  on("script-save-as", "click", guarded(() => save(true)));
  on("script-rename", "click", guarded(rename));
  on("script-close", "click", guarded(() => shut()));
  on("script-check", "click", guarded(() => check()));
  on("script-run", "click", guarded(runAll));
  on("script-part", "click", guarded(runPart));
  on("comment-on", "click", () => comment(true));
  on("comment-out", "click", () => comment(false));
  on("panes", "change", panes);
  on("more-toggle", "click", () => $("more-toggle").setAttribute("aria-expanded", $("editor").classList.toggle("more")));
  on("replace-all", "click", replaceAll);
  on("find", "keydown", (event) => { if (event.key === "Enter") { event.preventDefault(); findNext(); } });
  on("wrap", "change", () => { for (const one of papers) { one.area.wrap = $("wrap").checked ? "soft" : "off"; lines(one); } });
  addEventListener("beforeunload", (event) => { if (dirty()) event.preventDefault(); });
  try {
    const { first } = await json("scripts", {});
    await open(first);
    if (first && !picked) tab("editor");
  } catch (error) {
    complain(error);
    if (!opened) turn(new Paper({}));
  }
  look();
}

/** Texts that the page has written itself, in the language of now. */
export function speak() { if (!$("desk-toggle").hidden && opened) { show(); turn(opened); } }
