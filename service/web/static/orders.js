// Orders: measure, halt, resume. Each needs a token or a PIN.

import { at, make, say } from "./dom.js";
import { onLanguage, words } from "./words.js";
import { give } from "./giving.js";

let recipes = "";
let heard = null;
let told = () => (areOff ? words("no_orders") : "");
let isHaltTold = false;
let measured = null; // the job that was ordered here, as long as it runs

/** What a page has a job told besides its recipe. */
export const extra = {};

const CAN_MEASURE = ["Ready", "SingleExecution", "ContinuousExecution"];
const areOff = document.body.dataset.orders === "off"; // the page can only be looked at

/** Follow the state: which orders make sense now. */
export function show(state) {
  const isHalted = state.state === "Halted";
  if (heard?.state === "Halted" && !isHalted && isHaltTold) tell(() => "", false); // somebody else has ended it
  heard = state;
  allow(state);
  const focused = document.activeElement?.id;
  at("halt").hidden = isHalted;
  at("resume").hidden = !isHalted;
  if (focused === "halt" && isHalted) at("resume").focus();
  if (focused === "resume" && !isHalted) at("halt").focus();
  if (measured !== null && state.settled_job >= measured) ended(state.last_job);
  say("told", told());
  at("lease").hidden = !state.lease;
  say("lease", state.lease ? words("lease_of", { who: state.lease.who }) : "");
  fillRecipes();
}

function fillRecipes() {
  const key = JSON.stringify(heard.recipes) + document.documentElement.lang;
  if (key === recipes) return;
  recipes = key;
  const chosen = at("recipe").value;
  const options = heard.recipes.map(({ number, name }) => make("option", { value: number }, `${number} ${name}`));
  at("recipe").replaceChildren(make("option", { value: 0 }, words("default_recipe")), ...options);
  if (chosen) at("recipe").value = chosen;
}

/** True where a trigger would be taken in this state. */
export function isReady(state) {
  return CAN_MEASURE.includes(state.state) && !state.link?.not_ready;
}

/** What can be ordered now: what would be refused for the service's state, or for want of orders at all, cannot. */
export function allow(state) {
  const cannot = areOff || state === null;
  at("trigger").disabled = cannot || !isReady(state);
  for (const id of ["halt", "resume", "recipe"]) at(id).disabled = cannot;
}

function ended(last) {
  const isLast = last?.job === measured;
  measured = null;
  tell(() => (isLast ? `${words("job_runs", { job: last.job })}: ${words(last.outcome)}` : ""), isLast && last.code !== 0);
}

function ask(button, path, body, done) {
  if (at(button).disabled) return; // a key finds it as the button does
  const begun = () => {
    measured = null;
    tell(() => words("sending"), false);
  };
  const ended = (answer) => {
    tell(done(answer), false);
    isHaltTold = path === "/halt";
  };
  give({ path, body, begun, done: ended, failed: (text) => tell(text, true) });
}

export function tell(text, isBad) {
  told = text;
  isHaltTold = false;
  at("told").classList.toggle("bad", isBad);
  say("told", told());
}

export const measure = () =>
  ask("trigger", "/trigger", { recipe: Number(at("recipe").value), ...extra }, ({ job }) => {
    measured = job;
    return () => (job === null ? words("queued") : words("ordered", { job }));
  });

at("trigger").addEventListener("click", measure);
at("halt").addEventListener("click", () => ask("halt", "/halt", {}, () => () => words("halted_now")));
at("resume").addEventListener("click", () => ask("resume", "/resume", {}, () => () => words("resumed_now")));
onLanguage(() => {
  say("told", told());
  if (heard?.lease) say("lease", words("lease_of", { who: heard.lease.who }));
  if (heard) fillRecipes();
});
