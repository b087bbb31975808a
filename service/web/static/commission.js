// Setting a cell up: steps with a score each. What is done is the service's; this shows it, and asks for it.

import { at, draw, make, say, shape } from "./dom.js";
import { load, number, onLanguage, seenAs, words } from "./words.js";
import { get, listen } from "./service.js";
import { insist } from "./pace.js";
import { loadReasons } from "./reasons.js";
import { switchLanguage } from "./reader.js";
import { give } from "./giving.js";
import * as orders from "./orders.js";

const AGAIN_MS = 400;
const LIVE_MS = 400;
const STEPS = [...document.querySelectorAll("[data-step]")];
const DONE_HALTED = ["calibrate", "adopt", "align", "marks", "teach", "probe", "apply"];
const ALWAYS = ["look", "board", "shoot", "shoot-flat", "height", "point"];
const areOff = document.body.dataset.orders === "off";

let told = null;
let heard = null;
let asking = null;
let sharpest = 0;
let isFilled = false; // the fields, with what was told before

function heads() {
  for (const step of STEPS) {
    const name = step.dataset.step;
    const title = make("h2", { id: `title-${name}`, "data-t": `step_${name}` });
    const head = make("div", { class: "head" }, shape("none"), title, make("meter", { min: 0, max: 100, value: 0, "aria-labelledby": title.id }), make("output", {}, "–"));
    step.prepend(head, make("p", { "data-t": `do_${name}` }));
    step.append(make("p", { class: "fault", role: "alert", hidden: "" }), make("ul", { class: "lines" }), make("p", { class: "command" }, make("span", { "data-t": "command" }), " ", make("code")));
  }
}

/** What the service says, asked again as long as something is under way. */
async function refresh() {
  clearTimeout(asking);
  try {
    take(await get("/commission"));
  } catch {
    asking = setTimeout(refresh, 5 * AGAIN_MS); // the service is away, and the banner says so
  }
}

function take(next) {
  told = next;
  clearTimeout(asking);
  if (told.running) asking = setTimeout(refresh, AGAIN_MS);
  show();
}

function show() {
  if (!told) return;
  for (const element of STEPS) showStep(element, told.steps.find(({ name }) => name === element.dataset.step));
  fill();
  coverage();
  missing();
  shots();
  points();
  orders.extra.thickness_mm = told.thickness_mm ?? 0;
  say("running", told.running ? words("under_way", { what: words(told.running), progress: told.progress }) : "");
  say("changes", Object.keys(told.changes).length ? words("changes", { changes: Object.entries(told.changes).map((one) => one.join(": ")).join(", ") }) : "");
  at("report").hidden = !told.reported;
  allow();
}

function showStep(element, step) {
  const kind = step.well ? "accepted" : step.fault ? "refused" : "none";
  element.dataset.kind = kind;
  element.querySelector(".head use").setAttribute("href", `#s-${kind}`);
  element.querySelector("meter").value = step.score;
  element.querySelector(".head output").textContent = `${number(step.score)}\u00a0%`;
  const fault = element.querySelector(".fault");
  fault.hidden = !step.fault;
  fault.textContent = seenAs(step.fault ?? "");
  element.querySelector(".lines").replaceChildren(...step.lines.map((line) => make("li", {}, seenAs(line))));
  element.querySelector("code").textContent = step.command;
}

/** The fields as they were told before, once: what is being typed stays. */
function fill() {
  if (isFilled) return;
  isFilled = true;
  const { board, setup } = told;
  if (board) for (const key of ["kind", "squares_x", "squares_y", "square_mm", "marker_mm", "thickness_mm"]) at(key.replaceAll("_", "-")).value = board[key];
  at("height-mm").value = told.thickness_mm ?? "";
  for (const key of ["camera_height_mm", "block_mm", "accept_mm"]) at(key.replaceAll("_", "-")).value = setup[key] ?? "";
}

function coverage() {
  const most = Math.max(1, ...told.zones.flat());
  const seen = told.zones.flatMap((row, y) => row.map((count, x) => count && draw("rect", { x, y, width: 0.96, height: 0.96, "fill-opacity": 0.3 + (0.7 * count) / most })));
  at("coverage").replaceChildren(...seen.filter(Boolean));
}

function missing() {
  const lacks = [];
  const serving = told.shots.filter(({ serves }) => serves);
  if (!told.board) lacks.push(words("missing_board"));
  else {
    if (!serving.some(({ flat }) => flat)) lacks.push(words("missing_flat"));
    if (serving.length < told.wanted_views) lacks.push(words("missing_views", { n: told.wanted_views - serving.length }));
    for (const side of ["left", "right", "top", "bottom"]) if (!told.raised.includes(side)) lacks.push(words(`missing_${side}`));
    for (let part = 0; part < 9; part += 1) if (!seenIn(part)) lacks.push(words("missing_part", { part: words(`part_${part}`) }));
  }
  at("missing").replaceChildren(...(lacks.length ? lacks : [words("missing_none")]).map((text) => make("li", {}, text)));
}

/** True where corners were seen in one of nine parts of the picture, row by row. */
function seenIn(part) {
  const within = (count, third) => [Math.floor((count * third) / 3), Math.floor((count * (third + 1)) / 3)];
  const rows = told.zones.slice(...within(told.zones.length, Math.floor(part / 3)));
  return rows.some((row) => row.slice(...within(row.length, part % 3)).some(Boolean));
}

function shots() {
  const kept = new Map([...at("shots").children].map((one) => [Number(one.dataset.shot), one]));
  at("shots").replaceChildren(...told.shots.map((shot) => showShot(kept.get(shot.number) ?? shotOf(shot.number), shot)));
}

function shotOf(of) {
  const remove = make("button", { type: "button" });
  remove.addEventListener("click", () => act("remove", { shot: of }));
  return make("li", { "data-shot": of }, make("img", { src: `/api/v1/commission/shots/${of}` }), make("strong"), make("span"), remove);
}

function showShot(element, { number: of, flat, serves, corners, why }) {
  const [picture, name, verdict, remove] = element.children;
  element.dataset.kind = serves ? "accepted" : why ? "refused" : "none";
  name.textContent = picture.alt = words(flat ? "shot_flat" : "shot", { n: of });
  verdict.textContent = why ? seenAs(why) : words("corners", { n: corners });
  remove.textContent = words("remove");
  remove.setAttribute("aria-label", words("remove_of", { n: of }));
  return element;
}

function points() {
  at("points").replaceChildren(...told.points.map(([x, y, mx, my], index) => {
    const remove = make("button", { type: "button", "aria-label": words("forget_of", { n: index + 1 }) }, words("forget"));
    remove.addEventListener("click", () => act("forget", { point: index }));
    return make("li", {}, words("point_of", { x: number(x, 2), y: number(y, 2), mx: number(mx, 2), my: number(my, 2) }), remove);
  }));
}

/** What can be done now: all else would be refused. */
function allow() {
  const busy = areOff || !told || told.running !== null;
  for (const id of ALWAYS) at(id).disabled = busy;
  for (const id of DONE_HALTED) {
    at(id).disabled = busy || !told.halted;
    at(id).title = told?.halted ? "" : words("needs_halt");
  }
  at("adopt").disabled ||= !told?.adoptable;
  at("apply").disabled ||= !Object.keys(told?.changes ?? {}).length;
  for (const remove of document.querySelectorAll("#shots button, #points button")) remove.disabled = busy;
}

function act(name, body = {}) {
  const begun = () => {
    orders.tell(() => words("sending"), false);
    told = { ...told, running: name }; // nothing else can be pressed before the answer comes
    show();
  };
  const done = (answer) => {
    orders.tell(() => "", false);
    take(answer);
  };
  const failed = (text) => {
    orders.tell(text, true);
    refresh();
  };
  give({ path: `/commission/${name}`, body, begun, done, failed, byPin: false });
}

const valueOf = (id) => (at(id).value === "" ? null : Number(at(id).value));
/** What stands in these fields, by their names with _ for -. */
const valuesOf = (...ids) => Object.fromEntries(ids.map((id) => [id.replaceAll("-", "_"), valueOf(id)]));
const boardTold = () => ({
  kind: at("kind").value, ...valuesOf("squares-x", "squares-y", "square-mm"), marker_mm: valueOf("marker-mm") ?? 0, thickness_mm: valueOf("thickness-mm") ?? 0,
});
const setupTold = () => valuesOf("camera-height-mm", "block-mm", "accept-mm");

const BUTTONS = {
  look: () => act("look", { anew: at("anew").checked }), board: () => act("board", boardTold()),
  "shoot-flat": () => act("shoot", { flat: true }), shoot: () => act("shoot", { flat: false }),
  height: () => act("height", { thickness_mm: valueOf("height-mm") }), point: () => act("point", valuesOf("x-mm", "y-mm", "machine-x-mm", "machine-y-mm")),
  align: () => act("align", { jog_mm: valueOf("jog-mm") }), marks: () => act("marks", { dictionary: at("dictionary").value.trim() }),
  calibrate: () => act("calibrate", setupTold()), adopt: () => act("adopt"), teach: () => act("teach"),
  probe: () => act("probe", { write: at("write").checked }), apply: () => act("apply"),
};

async function live() {
  const isOn = at("live").getAttribute("aria-pressed") !== "true";
  at("live").setAttribute("aria-pressed", isOn);
  at("live-box").hidden = !isOn;
  let newest = 0;
  while (at("live").getAttribute("aria-pressed") === "true" && isOn) {
    newest = await look(newest).catch(() => newest); // the connection is lost, and is told
    await new Promise((again) => setTimeout(again, LIVE_MS));
  }
}

async function look(after) {
  if (document.hidden) return after;
  const { look: seen } = await get(`/live${after ? `?after=${after}` : ""}`);
  if (!seen) return after;
  if (seen.drawing) at("live-picture").src = `/api/v1/live/${seen.number}`;
  const { figures } = seen;
  sharpest = Math.max(sharpest, figures?.sharpness ?? 0);
  const share = (value) => number(100 * value, 1);
  say("live-figures", figures ? words("live_of", { now: number(figures.sharpness, 1), most: number(sharpest, 1), white: share(figures.white_share), black: share(figures.black_share) }) : words("live_off"));
  return seen.number;
}

function hear(state) {
  const changed = !heard || heard.state !== state.state || heard.last_job?.job !== state.last_job?.job;
  heard = state;
  say("state", words(state.state));
  orders.show(state);
  if (changed) refresh();
}

function lose() {
  heard = null;
  say("state", words("lost"));
  orders.allow(null);
}

heads();
await Promise.all([insist(() => load("commission.json"), () => {}), insist(loadReasons, () => {})]);
for (const element of document.querySelectorAll("[data-t]")) element.textContent = words(element.dataset.t);
at("language").addEventListener("click", switchLanguage);
at("live").addEventListener("click", live);
for (const [id, action] of Object.entries(BUTTONS)) at(id).addEventListener("click", action);
onLanguage(show);
allow();
listen(hear, lose);
