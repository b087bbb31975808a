// Orders: measure, halt, resume. Each needs a token, which is asked for once and forgotten soon.

import { at, make, say } from "./dom.js";
import { onLanguage, words } from "./words.js";
import { Refused, hasToken, order, remember } from "./service.js";
import { current, reasonOf } from "./now.js";

let recipes = "";
let pending = null;
let told = () => "";

/** Follow the state: which orders make sense now. */
export function show(state) {
  at("halt").hidden = state.state === "Halted";
  at("resume").hidden = state.state !== "Halted";
  const key = JSON.stringify(state.recipes) + document.documentElement.lang;
  if (key === recipes) return;
  recipes = key;
  const chosen = at("recipe").value;
  const options = state.recipes.map(({ number, name }) => make("option", { value: number }, `${number} ${name}`));
  at("recipe").replaceChildren(make("option", { value: 0 }, words("default_recipe")), ...options);
  if (chosen) at("recipe").value = chosen;
}

/** Have it done, after asking who orders it where that is not known. */
export function ask(path, body, done) {
  pending = { path, body, done };
  if (hasToken()) carryOut();
  else openDialog("");
}

function openDialog(text) {
  say("token-told", text);
  at("token").value = "";
  if (!at("token-dialog").open) at("token-dialog").showModal();
  at("token").focus();
}

async function carryOut() {
  const { path, body, done } = pending;
  try {
    const answer = await order(path, body);
    tell(() => done(answer), false);
  } catch (error) {
    if (!(error instanceof Refused)) tell(() => words(hasToken() ? "transfer_unknown" : "not_reached"), true);
    else if (error.status === 401) openDialog(error.message);
    else tell(() => refusal(error), true);
  }
}

function refusal(error) {
  const reason = error.code ? reasonOf(error.code) : null;
  return reason ? `${reason.sentence} ${reason.next_action} (${error.message})` : error.message;
}

function tell(text, isBad) {
  told = text;
  at("told").classList.toggle("bad", isBad);
  say("told", told());
}

export const measure = () =>
  ask("/trigger", { recipe: Number(at("recipe").value) }, ({ job }) => (job === null ? words("queued") : words("ordered", { job })));

at("trigger").addEventListener("click", measure);
at("halt").addEventListener("click", () => ask("/halt", {}, () => words("halted_now")));
at("resume").addEventListener("click", () => ask("/resume", {}, () => words("resumed_now")));
at("token-cancel").addEventListener("click", () => at("token-dialog").close());
at("token-dialog").querySelector("form").addEventListener("submit", () => {
  const given = at("token").value.trim();
  at("token").value = "";
  if (!given) return;
  remember(given);
  carryOut();
});
onLanguage(() => {
  say("told", told());
  const state = current();
  if (state) show(state);
});
