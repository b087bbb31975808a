// The live view: what the camera sees now, and what a job would make of it, as long as somebody looks.

import { at, make, say } from "./dom.js";
import { amount, moment, number, onLanguage, seenAs, words } from "./words.js";
import { get } from "./service.js";
import { current } from "./now.js";
import { reasonOf } from "./reasons.js";
import { isReady } from "./orders.js";
import * as film from "./film.js";
import * as picture from "./picture.js";

const PAUSE_MS = 300; // from a look that is shown to the next question
const FORGOTTEN_MS = 600_000; // without a touch: the camera is not kept at work for an empty hall

let turn = 0; // of looking: what comes for an older one comes too late
let isOn = false;
let answer = null;
let look = null; // the newest that there was
let sharpest = 0;
let forgetting = null;

const address = ({ number: of }) => `/api/v1/live/${of}`;

export function toggle() {
  if (isOn) end();
  else begin();
}

async function begin() {
  turn += 1;
  const mine = turn;
  [isOn, answer, look, sharpest] = [true, null, null, 0];
  mark();
  touched();
  while (mine === turn && isOn) {
    if (!document.hidden) await step(mine);
    await new Promise((again) => setTimeout(again, PAUSE_MS));
  }
}

export function end() {
  if (!isOn) return;
  isOn = false;
  clearTimeout(forgetting);
  mark();
  film.live();
}

function touched() {
  clearTimeout(forgetting);
  if (isOn) forgetting = setTimeout(end, FORGOTTEN_MS);
}

function mark() {
  at("live").setAttribute("aria-pressed", isOn);
  at("live-view").hidden = !isOn;
  document.body.classList.toggle("live", isOn);
  film.hold(isOn);
  refresh();
}

async function step(mine) {
  try {
    const next = await get(`/live${look ? `?after=${look.number}` : ""}`);
    if (next.look?.drawing) await loaded(address(next.look));
    if (mine !== turn || !isOn) return;
    answer = next;
    if (next.look) take(next.look);
    refresh();
  } catch {
    // The connection is lost, and the banner says so; or the picture was not kept, and a newer one is.
  }
}

/** The picture is there before it is drawn: what was there would else make room for nothing. */
async function loaded(source) {
  const image = new Image();
  image.src = source;
  await image.decode();
}

function take(next) {
  look = next;
  sharpest = Math.max(sharpest, look.figures?.sharpness ?? 0);
  if (look.drawing) picture.show(look.drawing, address(look));
}

function refresh() {
  if (!isOn) return;
  const state = current();
  say("live-waits", words(`live_${answer?.waits_for ?? (!answer ? "start" : state && !isReady(state) ? "not_taken" : "now")}`));
  const refused = look?.findings[0];
  at("live-verdict").dataset.kind = look ? (refused ? "refused" : "accepted") : "none";
  at("live-verdict").querySelector("use").setAttribute("href", `#s-${at("live-verdict").dataset.kind}`);
  say("live-word", look ? words(refused ? "live_refused" : "live_accepted") : "–");
  const told = refused ? reasonOf(refused.code) : null;
  at("live-because").hidden = !refused;
  at("live-because").replaceChildren(make("strong", {}, told?.sentence ?? ""), ` ${told?.next_action ?? ""}`, make("small", {}, seenAs(refused?.text ?? "")));
  at("live-values").replaceChildren(...figures().flatMap(([key, value]) => [make("dt", {}, words(key)), make("dd", {}, value)]));
}

function figures() {
  if (!look) return [];
  const share = (value) => `${number(100 * value, 1)}\u00a0%`;
  const { figures: seen, drawing } = look;
  const size = drawing?.size_mm;
  const rows = [
    ["sharpness", seen && words("sharpness_of", { now: number(seen.sharpness, 1), most: number(sharpest, 1) })],
    ["clipped", seen && share(seen.white_share)],
    ["black", seen && share(seen.black_share)],
    ["lightness", seen && words("lightness_of", { grey: number(seen.mean_grey) })],
    ["size", size && `${number(size[0], 1)} × ${amount(size[1], "mm", 1)}`],
    ["recipe", `${look.recipe.number} ${look.recipe.name}`],
    ["when", moment(look.at)],
  ];
  return rows.filter(([, value]) => value);
}

at("live").addEventListener("click", toggle);
at("film").addEventListener("click", (event) => event.target.closest("button:not(nav button)") && end(), true);
for (const kind of ["pointerdown", "keydown"]) document.addEventListener(kind, touched);
onLanguage(refresh);
