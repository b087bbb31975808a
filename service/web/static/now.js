// The service now: banner, counters, why it is not ready, and its parts at a glance.

import { at, make, say, shape } from "./dom.js";
import { bytes, duration, moment, number, onLanguage, seenAs, words } from "./words.js";
import { reasonOf, sentenceOf } from "./reasons.js";

const KINDS = {
  Preoperational: "starting", Initialized: "starting", Ready: "ready", SingleExecution: "busy",
  ContinuousExecution: "busy", Halted: "halted", Error: "fault",
};

/** Words of where a job came from, where they are not those of its name. */
export const ORIGINS = { controller: "controller_kind" };

let state = null;
let heardAt = null;
let isLost = false;
let byReason = { refused: [], failed: [], missed: [] };

export function show(next) {
  state = next;
  heardAt = new Date();
  isLost = false;
  refresh();
}

export function lose() {
  isLost = true;
  refresh();
}

export function current() {
  return isLost ? null : state;
}

function refresh() {
  document.body.classList.toggle("stale", isLost);
  banner();
  if (!state) return;
  last();
  counters();
  whys();
  glance();
}

function banner() {
  if (isLost || !state) {
    if (isLost) put("lost", words("lost"), heardAt ? words("seen_last", { time: moment(heardAt) }) : words("never_seen"));
    return;
  }
  const notReady = state.link && state.link.not_ready;
  const kind = state.state === "Ready" && notReady ? "waiting" : KINDS[state.state];
  const told = state.code ? reasonOf(state.code)?.sentence : null;
  const why = told ?? (kind === "halted" ? seenAs(state.reason) : null);
  const job = state.job === null ? null : words("job_runs", { job: state.job });
  put(kind, words(kind === "waiting" ? "waiting" : state.state), [job, words("since", { time: duration(state.since_s) }), why].filter(Boolean).join(" · "));
}

/** What became of the last block; while the next one is measured it is of before, and not in the colour of a result. */
function last() {
  const { last_job: job, job: running } = state;
  const outcome = job?.outcome ?? "none";
  const told = job?.code ? reasonOf(job.code) : null;
  mark("last", outcome);
  at("last").classList.toggle("before", running !== null);
  say("last-word", words(outcome));
  say("last-of", job ? `${words("job_runs", { job: job.job })}, ${moment(job.settled_at)}` : "");
  say("last-why", told ? `${told.sentence} ${told.next_action}` : "");
}

/** Colour and shape of one of the two words above. */
function mark(id, kind) {
  const element = at(id);
  if (element.dataset.kind === kind) return;
  element.dataset.kind = kind;
  element.querySelector("use").setAttribute("href", `#s-${kind}`);
}

function put(kind, word, line) {
  mark("banner", kind);
  say("state", word);
  say("since", line);
  document.title = `${word} – combtrace`;
}

function counters() {
  const counts = { accepted: 0, refused: 0, failed: 0 };
  byReason = { accepted: [], refused: [], failed: [], missed: [] };
  for (const { outcome, reason, count } of state.outcomes) {
    const name = outcome === "written" ? "accepted" : outcome;
    counts[name] += count;
    if (reason) byReason[name].push([sentenceOf(reason), number(count)]);
  }
  for (const name of Object.keys(counts)) {
    say(`count-${name}`, number(counts[name]));
    at(`count-${name}`).title = byReason[name].map((line) => line.join(" ")).join("\n");
  }
  for (const { kind, what, count } of state.triggers) {
    if (what !== "taken") byReason.missed.push([`${words(ORIGINS[kind] ?? kind)}: ${sentenceOf(what)}`, number(count)]);
  }
  say("count-missed", number(state.missed_triggers));
}

/** What a counter counts, by reason: a finger cannot point at it without a touch. */
function showCounts(name) {
  say("counts-title", words(name));
  const rows = byReason[name].flatMap(([sentence, count]) => [make("dt", {}, count), make("dd", {}, sentence)]);
  at("counts").replaceChildren(...(rows.length ? rows : [make("dd", {}, words(name === "missed" ? "none_missed" : "no_jobs"))]));
  at("counts-dialog").showModal();
}

function whys() {
  const entries = Object.entries(state.faults).map(([part, fault]) => why(reasonOf(fault.code), `${words(part)}: ${seenAs(fault.text)}`));
  const faults = entries.length;
  if (state.state === "Halted" && !faults) entries.push(why({ sentence: words("halted_why"), next_action: words("halted_do") }, seenAs(state.reason)));
  if (!faults && state.state === "Ready" && state.link?.not_ready) entries.push(why({ sentence: words("waiting_why"), next_action: words("waiting_do") }, seenAs(state.link.not_ready)));
  for (const [part, text] of Object.entries(state.warnings)) entries.push(why({ sentence: words("warning"), next_action: "" }, `${words(part)}: ${seenAs(text)}`));
  const list = at("whys");
  if (list.textContent !== entries.map((entry) => entry.textContent).join("")) list.replaceChildren(...entries);
  at("why").hidden = !entries.length;
  at("why").classList.toggle("mild", !faults);
}

function why(told, text) {
  return make("li", {}, make("strong", {}, told?.sentence ?? ""), " ", told?.next_action ?? "", make("small", {}, text ?? ""));
}

function glance() {
  const { camera, link, calibration, disk, faults } = state;
  const lines = [
    line("camera", camera.up, `${camera.what}, ${words(camera.up ? "works" : "broken")}`),
    link
      ? line("link", link.up, `${link.what}, ${link.up && link.round_trip_ms !== null ? words("round_trip", { ms: number(link.round_trip_ms, 1) }) : words(link.up ? "works" : "broken")}`)
      : line("link", null, words("no_link")),
    line("calibration", !("calibration" in faults) && (calibration && calibration.age_days !== null ? true : null), ageOf(calibration)),
    line("disk", !("storage" in faults || "journal" in faults), disk.journal_free_bytes === null ? words("not_known") : words("disk_free", { free: bytes(disk.journal_free_bytes), kept: bytes(disk.archive_bytes) })),
  ];
  at("glance").replaceChildren(...lines);
}

function ageOf(calibration) {
  if (!calibration) return words("no_calibration");
  const { age_days: age, max_age_days: most } = calibration;
  if (age === null) return words("age_unknown");
  const days = number(Math.max(age, 0));
  return most ? words("days_of", { days, most: number(most) }) : words("days_old", { days });
}

function line(key, well, text) {
  const kind = well === null ? "none" : well ? "accepted" : "failed";
  const mark = shape(kind);
  mark.dataset.kind = kind;
  return make("li", {}, mark, make("span", { class: "what" }, words(key)), make("span", {}, text));
}

for (const name of ["refused", "failed", "missed"]) at(`count-${name}`).addEventListener("click", () => showCounts(name));
onLanguage(refresh);
