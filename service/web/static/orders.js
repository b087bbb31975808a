// Orders: measure, halt, resume. Each needs a token or a PIN, which is asked for once and forgotten soon.

import { at, make, say } from "./dom.js";
import { onLanguage, seenAs, words } from "./words.js";
import { Refused, get, isKnown, order, remember } from "./service.js";
import { reasonOf } from "./now.js";

let recipes = "";
let pending = null;
let heard = null;
let told = () => (areOff ? words("no_orders") : "");
let isUnderWay = false; // an order that is not answered yet
let isHaltTold = false;
let measured = null; // the job that was ordered here, as long as it runs

const CAN_MEASURE = ["Ready", "SingleExecution", "ContinuousExecution"];
const areOff = document.body.dataset.orders === "off"; // the page can only be looked at
const REFUSALS = { 401: "wrong_token", 403: "no_orders", 409: "not_now", 429: "too_often", 503: "cannot" };

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

/** Have it done, one order at a time, after asking who orders it where that is not known. */
export function ask(button, path, body, done) {
  if (isUnderWay || at(button).disabled) return; // a key finds it as the button does
  pending = { path, body, done };
  if (isKnown()) carryOut();
  else openDialog("");
}

async function openDialog(text) {
  say("token-told", text);
  at("token").value = "";
  if (!at("token-dialog").open) at("token-dialog").showModal();
  at("token").focus();
  try {
    fillPeople((await get("/people")).names);
  } catch {
    fillPeople([]); // then by a token
  }
}

/** Who has a PIN, to be touched; the last entry is for those who have a token. */
function fillPeople(names) {
  const chosen = at("person").value;
  at("person").replaceChildren(...names.map((name) => make("option", { value: name }, name)), make("option", { value: "" }, words("with_token")));
  if (names.includes(chosen)) at("person").value = chosen;
  at("by-person").hidden = !names.length;
  askedFor();
}

function askedFor() {
  const isPin = at("person").value !== "";
  at("token").inputMode = isPin ? "numeric" : "text";
  say("token-what", words(isPin ? "pin" : "token"));
  say("token-text", words(isPin ? "pin_text" : "token_text"));
}

async function carryOut() {
  const { path, body, done } = pending;
  isUnderWay = true;
  measured = null;
  tell(() => words("sending"), false);
  try {
    const answer = await order(path, body);
    tell(done(answer), false);
    isHaltTold = path === "/halt";
  } catch (error) {
    if (!(error instanceof Refused)) tell(() => words("transfer_unknown"), true);
    else tell(() => refusal(error), true);
    if (error.status === 401) openDialog(words(at("person").value ? "wrong_pin" : "wrong_token"));
    if (error.holder) openTakeOver(error.holder);
  } finally {
    isUnderWay = false;
  }
}

function openTakeOver(who) {
  say("lease-told", words("lease_of", { who }));
  at("take-over").value = "";
  at("lease-dialog").showModal();
  at("take-over").focus();
}

function refusal(error) {
  if (error.holder) return words("lease_of", { who: error.holder });
  const reason = error.code ? reasonOf(error.code) : null;
  const text = reason ? `${reason.sentence} ${reason.next_action}` : words(REFUSALS[error.status] ?? "cannot");
  return `${text} (${seenAs(error.message)})`;
}

function tell(text, isBad) {
  told = text;
  isHaltTold = false;
  at("told").classList.toggle("bad", isBad);
  say("told", told());
}

export const measure = () =>
  ask("trigger", "/trigger", { recipe: Number(at("recipe").value) }, ({ job }) => {
    measured = job;
    return () => (job === null ? words("queued") : words("ordered", { job }));
  });

at("trigger").addEventListener("click", measure);
at("halt").addEventListener("click", () => ask("halt", "/halt", {}, () => () => words("halted_now")));
at("resume").addEventListener("click", () => ask("resume", "/resume", {}, () => () => words("resumed_now")));
at("token-cancel").addEventListener("click", () => at("token-dialog").close());
at("token-dialog").querySelector("form").addEventListener("submit", () => {
  const given = at("token").value.trim();
  at("token").value = "";
  if (!given) return;
  remember(at("person").value ? `Pin ${at("person").value}:${given}` : `Bearer ${given}`);
  carryOut();
});
at("person").addEventListener("change", () => {
  askedFor();
  at("token").focus();
});
at("lease-cancel").addEventListener("click", () => at("lease-dialog").close());
at("lease-dialog").querySelector("form").addEventListener("submit", () => {
  pending.body = { ...pending.body, take_over: at("take-over").value.trim() };
  carryOut();
});
onLanguage(() => {
  say("told", told());
  askedFor();
  if (heard?.lease) say("lease", words("lease_of", { who: heard.lease.who }));
  if (heard) fillRecipes();
});
