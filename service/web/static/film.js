// The last jobs as a strip of small pictures; which one is shown large, and whether it follows the newest.

import { at, make, say, shape } from "./dom.js";
import { onLanguage, words } from "./words.js";
import { get } from "./service.js";
import * as job from "./job.js";
import * as picture from "./picture.js";

const SHOWN = 16;
const EVIDENCE_TRIES = 5; // the service tells too; this is for what it cannot tell
const EVIDENCE_PAUSE_MS = 1000;

let jobs = [];
let opened = null; // the job that is looked at; null = always the newest
let isFrozen = false;
let isHeld = false; // something else is shown large
let onlyRefused = false;
let before = null;
let shownAs = "";
let loading = false;
let turn = 0; // of what is to be shown: what comes for an older one comes too late
let again = false;
let awaited = { job: 0, tries: 0 };

const tag = (one) => encodeURIComponent(one.settled_at ?? one.taken_at);
const frameOf = (one, width) => `/api/v1/frames/${one.job_id}?width=${width}&of=${tag(one)}`;

/** Look for what is new; while one look is under way, one more is kept in mind. */
export async function refresh() {
  if (loading) {
    again = true;
    return;
  }
  loading = true;
  try {
    do {
      again = false;
      await load();
    } while (again);
  } finally {
    loading = false;
  }
}

async function load() {
  if (isFrozen) return;
  const query = queryOf(before);
  let found;
  try {
    found = (await get(query)).jobs;
  } catch {
    return; // the connection is lost, and the banner says so
  }
  if (isFrozen || query !== queryOf(before)) return; // meanwhile something else is wanted
  jobs = found;
  strip();
  await display();
  if (jobs.length && isAwaited(jobs[0])) {
    awaited.tries += 1;
    setTimeout(refresh, EVIDENCE_PAUSE_MS);
  }
}

function queryOf(below) {
  return `/jobs?limit=${SHOWN}${onlyRefused ? "&only_refused=true" : ""}${below ? `&before=${below}` : ""}`;
}

/** True while pictures of a job may still come: they are kept after its end. Counted, for clocks may differ. */
function isAwaited(one) {
  if (!one.outcome || one.files.length) return false;
  if (awaited.job !== one.job_id) awaited = { job: one.job_id, tries: 0 };
  return awaited.tries < EVIDENCE_TRIES;
}

/** Something else is shown large, or no longer. */
export function hold(held) {
  isHeld = held;
  turn += 1;
  shownAs = "";
  mark();
}

/** The job looked at, or the newest that has come to an end. */
async function display() {
  turn += 1;
  if (isHeld) return;
  const mine = turn;
  const one = opened === null ? jobs.find((entry) => entry.outcome) ?? jobs[0] : jobs.find((entry) => entry.job_id === opened) ?? (await fetched(opened));
  if (mine !== turn) return;
  if (!one) {
    picture.show(null, "", "no_jobs");
    return;
  }
  const state = `${one.job_id} ${one.outcome} ${one.files.length} ${one.settled_at}`;
  if (state === shownAs) return;
  let drawing = null;
  if (one.files.includes("frame.png")) {
    try {
      drawing = await get(`/jobs/${one.job_id}/drawing`);
    } catch {
      drawing = null; // let go just now
    }
  } else if (opened === null && shownAs && isAwaited(one)) {
    return; // its picture follows in a moment: all of it is shown at once
  }
  if (mine !== turn) return;
  shownAs = state;
  job.show(one, drawing);
  picture.show(drawing, frameOf(one, 1600));
  mark();
}

async function fetched(number) {
  try {
    return await get(`/jobs/${number}`);
  } catch {
    return null;
  }
}

function strip() {
  const known = new Map([...at("strip").children].map((item) => [item.dataset.as, item]));
  const items = jobs.map((one) => {
    const as = `${one.job_id} ${one.outcome} ${one.files.length} ${document.documentElement.lang}`;
    return known.get(as) ?? item(one, as);
  });
  const same = items.length === at("strip").children.length && items.every((one, k) => one === at("strip").children[k]);
  if (!same) at("strip").replaceChildren(...(items.length ? items : [make("li", {}, words("no_jobs"))]));
  mark();
}

function item(one, as) {
  const kind = one.outcome ?? "running";
  const name = `${words("job_runs", { job: one.job_id })}: ${words(kind)}`;
  const image = one.files.includes("frame.png") ? make("img", { src: frameOf(one, 320), alt: "", loading: "lazy" }) : make("div", { class: "no" }, words("no_frame"));
  const label = make("span", { "data-kind": kind }, shape(one.outcome ?? "busy"), String(one.job_id));
  const button = make("button", { type: "button", "aria-label": name, title: name, "data-job": one.job_id }, image, label);
  button.addEventListener("click", () => open(one.job_id));
  return make("li", { "data-as": as }, button);
}

function mark() {
  const shown = Number(shownAs.split(" ")[0]);
  say("seen-job", isHeld ? `– ${words("live_title")}` : shown ? `– ${words("job_runs", { job: shown })}` : "");
  for (const button of at("strip").querySelectorAll("button")) button.setAttribute("aria-current", Number(button.dataset.job) === shown);
  say("seen-note", isFrozen || opened !== null ? `– ${words("frozen")}` : "");
  at("freeze").setAttribute("aria-pressed", isFrozen || opened !== null);
  say("freeze", words(isFrozen || opened !== null ? "unfreeze" : "freeze"));
  at("only-refused").setAttribute("aria-pressed", onlyRefused);
}

function open(number) {
  opened = number;
  mark();
  display();
}

/** Follow the newest again. */
export function live() {
  opened = null;
  isFrozen = false;
  before = null;
  shownAs = "";
  mark();
  refresh();
}

export function freeze() {
  if (isFrozen || opened !== null) {
    live();
    return;
  }
  isFrozen = true;
  turn += 1;
  mark();
}

export function toggleRefused() {
  onlyRefused = !onlyRefused;
  live();
}

/** The job `step` places further in the strip: 1 = older. */
export function go(step) {
  const shown = Number(shownAs.split(" ")[0]);
  const place = jobs.findIndex((one) => one.job_id === shown) + step;
  if (!jobs[place]) return;
  open(jobs[place].job_id);
  at("strip").children[place].scrollIntoView({ block: "nearest", inline: "nearest" });
}

async function older() {
  if (jobs.length < SHOWN) return;
  const below = jobs.at(-1).job_id;
  let found;
  try {
    found = (await get(queryOf(below))).jobs;
  } catch {
    return;
  }
  if (!found.length || below !== jobs.at(-1)?.job_id) return; // there are no older ones, or others are wanted
  before = below;
  isFrozen = false;
  jobs = found;
  strip();
  open(jobs[0].job_id);
}

at("freeze").addEventListener("click", freeze);
at("only-refused").addEventListener("click", toggleRefused);
at("older").addEventListener("click", older);
at("newest").addEventListener("click", live);
onLanguage(() => {
  strip();
  mark();
});
