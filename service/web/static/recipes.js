// The page of recipes: what is in force, a change that is tried on archived jobs, and what was adopted.

import { at, make, say } from "./dom.js";
import { chosen, load, moment, onLanguage, seenAs, words } from "./words.js";
import { get } from "./service.js";
import { insist } from "./pace.js";
import { loadReasons } from "./reasons.js";
import { switchLanguage } from "./reader.js";
import { give } from "./giving.js";
import * as form from "./recipe-form.js";
import * as tried from "./tried.js";

const BUSY_MS = 1_000;
const CALM_MS = 5_000;
const areOff = document.body.dataset.orders === "off"; // the page can only be looked at
let known = null; // what the service says of recipes
let selected = null; // number
let shown = []; // of which recipe, in which language and state, the form is
let trial = null;
let looking = null;

const recipe = () => known.recipes.find(({ number }) => number === selected);

async function look() {
  clearTimeout(looking);
  try {
    [known, { trial }] = await Promise.all([get("/recipes"), get("/recipes/trial")]);
    at("lost").hidden = true;
    if (!recipe()) selected = known.default;
    refresh();
  } catch {
    at("lost").hidden = false;
  }
  looking = setTimeout(look, trial?.state === "running" ? BUSY_MS : CALM_MS);
}

function refresh() {
  at("trouble").hidden = known.trouble === null;
  say("trouble", known.trouble === null ? "" : seenAs(known.trouble));
  list();
  say("edit-title", `${recipe().number} ${recipe().name}`);
  fill();
  tried.show(trial);
  history();
  allow();
  for (const id of ["told", "adopt-told"]) if (at(id).told) say(id, at(id).told());
}

function list() {
  const buttons = known.recipes.map(({ number, name, adopted }) => {
    const told = [number === known.default ? words("usual") : null, adopted[0]?.in_force && adopted[0].changes.length ? words("is_adopted") : null].filter(Boolean);
    const button = make("button", { type: "button", "aria-pressed": number === selected }, `${number} ${name}`, make("small", {}, told.join(", ")));
    button.addEventListener("click", () => {
      selected = number;
      refresh();
    });
    return make("li", {}, button);
  });
  if (at("recipes").textContent !== buttons.map((one) => one.textContent).join("") || at("recipes").dataset.of !== String(selected)) {
    const isFocused = at("recipes").contains(document.activeElement);
    at("recipes").replaceChildren(...buttons);
    at("recipes").dataset.of = selected;
    if (isFocused) at("recipes").querySelector('[aria-pressed="true"]').focus();
  }
}

/** The form, made anew only where it is of something else; what somebody has typed stays as long as it is that recipe. */
function fill() {
  const next = [selected, chosen(), JSON.stringify(recipe())];
  if (next.join() === shown.join()) return;
  form.show(recipe(), selected === shown[0] ? form.changes() : {});
  shown = next;
}

function history() {
  const entries = recipe().adopted.map((one) => {
    const name = one.number ? `${words("adoption", { number: one.number })} ${moment(one.at)}, ${one.who}: ${one.note}` : words("as_written");
    const again = make("button", { type: "button", "data-back": one.number }, words(one.in_force ? "in_force" : "adopt_again"));
    again.disabled = areOff || one.in_force || known.trouble !== null;
    again.addEventListener("click", () => back(one.number));
    return make("li", {}, make("div", { class: "row" }, make("span", {}, name), again), make("ul", {}, ...tried.changesOf(one.changes)));
  });
  if (at("history").dataset.of === JSON.stringify([chosen(), recipe().adopted])) return;
  at("history").dataset.of = JSON.stringify([chosen(), recipe().adopted]);
  at("history").replaceChildren(...(entries.length ? entries : [make("li", {}, words("never_adopted"))]));
}

function allow() {
  const isChanged = form.mark();
  const isRunning = trial?.state === "running";
  at("try").disabled = areOff || !isChanged || isRunning;
  at("undo").disabled = !isChanged;
  at("adopt").disabled = areOff || known.trouble !== null || !canBeAdopted();
  at("stop").disabled = areOff;
}

/** True where the last try was of this recipe, has come to its end, and is not in force already. */
function canBeAdopted() {
  if (trial?.state !== "done" || trial.recipe !== selected || !trial.jobs.length) return false;
  return trial.changes.some(({ key, after }) => JSON.stringify(recipe().values[key]) !== JSON.stringify(after));
}

/** How an order goes, beside the button that gave it. */
function telling(id) {
  return (text, isBad) => {
    at(id).classList.toggle("bad", isBad);
    at(id).told = text;
    say(id, text());
  };
}

function order(id, path, body, told) {
  const tell = telling(id);
  const done = (answer) => {
    tell(() => told(answer), false);
    look();
  };
  give({ path, body, begun: () => tell(() => words("sending"), false), done, failed: (text) => tell(text, true) });
}

function back(adoption) {
  if (!at("note").reportValidity()) return;
  order("adopt-told", `/recipes/${selected}/back`, { adoption, note: at("note").value.trim() }, adopted);
}

function adopted(answer) {
  at("note").value = "";
  return words("adopted_now", answer);
}

at("form").addEventListener("submit", (event) => {
  event.preventDefault();
  order("told", `/recipes/${selected}/trial`, { changes: form.changes(), jobs: Number(at("jobs").value) }, () => (trial?.state === "running" ? words("tried_now") : ""));
});
at("form").addEventListener("input", allow);
at("undo").addEventListener("click", () => {
  form.show(recipe());
  allow();
});
at("stop").addEventListener("click", () => order("told", "/recipes/trial/stop", {}, () => ""));
at("adopt-form").addEventListener("submit", (event) => {
  event.preventDefault();
  order("adopt-told", `/recipes/${selected}/adopt`, { trial: trial.number, note: at("note").value.trim() }, adopted);
});
at("language").addEventListener("click", switchLanguage);
onLanguage(() => known && refresh());

const lost = () => (at("lost").hidden = false);
await Promise.all([insist(() => load("recipes.json"), lost), insist(loadReasons, lost), insist(() => get("/recipes/schema").then(form.use), lost)]);
if (areOff) telling("told")(() => words("no_orders"), false);
for (const id of ["language", "theme"]) at(id).disabled = false;
await look();
