// What a changed recipe makes of archived jobs, picture by picture: both outlines, both verdicts, and how far apart.

import { at, draw, make, say, shape } from "./dom.js";
import { get } from "./service.js";
import { reasonOf } from "./reasons.js";
import { text } from "./recipe-form.js";
import { amount, moment, number, onLanguage, seenAs, words } from "./words.js";

const THUMB_PX = 320;
const LARGE_PX = 1600;
let trial = null;
let drawings = new Map(); // of this try, by job: what was drawn, and what would have been

/** Show a try as far as it is; null where there was none. */
export function show(next) {
  if (next?.number !== trial?.number) {
    drawings = new Map();
    at("tried").replaceChildren();
  }
  trial = next;
  refresh();
}

function refresh() {
  at("trial").hidden = !trial;
  if (!trial) return;
  const isRunning = trial.state === "running";
  const done = trial.jobs.length + trial.left_out.length;
  say("trial-title", words("trial_of", { recipe: trial.recipe, who: trial.who }));
  at("trial-changes").replaceChildren(...changesOf(trial.changes));
  at("progress").max = trial.wanted;
  at("progress").value = done;
  at("progress").hidden = !isRunning;
  at("stop").hidden = !isRunning;
  say("summary", `${words(`trial_${trial.state}`, { done, wanted: trial.wanted })} ${summary()}`);
  for (const one of trial.jobs) card(one);
  at("left-out").replaceChildren(...trial.left_out.map((one) => make("li", {}, words("left_out", { job: one.job_id, why: seenAs(one.why) }))));
}

/** Changes of keys, each a line. */
export function changesOf(changes) {
  return changes.map(({ key, before, after }) => make("li", {}, make("code", {}, key), ` ${text(before)} → ${text(after)}`));
}

function summary() {
  const refused = trial.jobs.filter((one) => one.flipped && one.code_after).length;
  const accepted = trial.jobs.filter((one) => one.flipped && !one.code_after).length;
  const far = trial.jobs.filter((one) => one.distance !== null).sort((one, other) => other.distance - one.distance)[0];
  const told = [refused || accepted ? words("flips", { refused, accepted }) : words("no_flips")];
  if (far?.distance) told.push(words("farthest", { far: amount(far.distance, far.unit, 2), job: far.job_id }));
  return trial.jobs.length ? told.join(" ") : "";
}

/** A job's card, made when it comes and told anew when the language changes. */
function card(one) {
  const id = `tried-${one.job_id}`;
  const known = at(id);
  if (known?.dataset.lang === document.documentElement.lang) return;
  const picture = known?.querySelector(".tile svg") ?? draw("svg", { class: "outlines", viewBox: "0 0 4 3" });
  const name = words("job_runs", { job: one.job_id });
  const tile = make("button", { type: "button", class: "tile", "aria-label": words("larger", { job: one.job_id }) }, picture);
  tile.addEventListener("click", () => enlarge(one));
  const lines = [make("p", {}, make("strong", {}, name), ` ${moment(one.taken_at)}`), verdicts(one), ...why(one), make("p", {}, difference(one))];
  const item = make("li", { id, class: one.flipped ? "flipped" : "", "data-lang": document.documentElement.lang }, tile, ...lines);
  if (known) known.replaceWith(item);
  else at("tried").append(item);
  if (!known) outline(one, picture);
}

function verdicts(one) {
  const line = make("p", {}, verdict(one.code_before), " → ", verdict(one.code_after));
  if (one.flipped) line.append(" ", make("strong", {}, words("flipped")));
  return line;
}

function verdict(code) {
  const kind = code ? "refused" : "accepted";
  return make("span", { class: "mark", "data-kind": kind }, shape(kind), words(kind));
}

function why(one) {
  const code = one.code_after || one.code_before;
  if (!code) return [];
  const told = make("p", {}, `${code} ${reasonOf(code)?.sentence ?? ""}`);
  return one.text ? [told, make("p", { class: "dim" }, seenAs(one.text))] : [told];
}

function difference(one) {
  const apart = one.distance === null ? words("no_distance") : one.distance === 0 ? words("same_outline") : words("apart", { far: amount(one.distance, one.unit, 2) });
  if (one.area_mm2_before === null || one.area_mm2_after === null) return apart;
  const [before, after] = [number(one.area_mm2_before), amount(one.area_mm2_after, "mm²")];
  return `${apart} ${words("areas", { before, after })}`;
}

async function outline(one, picture) {
  const of = drawings;
  try {
    of.set(one.job_id, await Promise.all([get(`/jobs/${one.job_id}/drawing`), get(`/recipes/trial/${one.job_id}/drawing`)]));
  } catch {
    return; // let go just now; its words stay
  }
  if (of === drawings) drawInto(picture, one, THUMB_PX);
}

function drawInto(picture, one, width) {
  const [was, now] = drawings.get(one.job_id);
  picture.setAttribute("viewBox", `-0.5 -0.5 ${now.width} ${now.height}`);
  const frame = { href: `/api/v1/frames/${one.job_id}?width=${width}`, x: -0.5, y: -0.5, width: now.width, height: now.height, preserveAspectRatio: "none" };
  const outlines = [[`now${now.refused ? " refused" : ""}`, rings(now)], ["was", rings(was)]].filter(([, d]) => d);
  const under = outlines.map(([, d]) => draw("path", { class: "under", d })); // of both, that neither hides the other
  picture.replaceChildren(draw("image", frame), ...under, ...outlines.map(([kind, d]) => draw("path", { class: kind, d })));
}

const rings = ({ exterior, holes }) => [exterior, ...holes].filter((ring) => ring.length).map((ring) => `M${ring.map(([x, y]) => `${x} ${y}`).join("L")}Z`).join("");

function enlarge(one) {
  if (!drawings.has(one.job_id)) return;
  const picture = draw("svg", { class: "outlines" });
  drawInto(picture, one, LARGE_PX);
  say("large-title", words("job_runs", { job: one.job_id }));
  at("large-picture").replaceChildren(picture);
  at("large").showModal();
}

onLanguage(refresh);
