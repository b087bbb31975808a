// Giving an order: who gives it is asked for once and forgotten soon, and why they take over from another person.

import { at, make, say } from "./dom.js";
import { onLanguage, seenAs, words } from "./words.js";
import { Refused, get, isKnown, order, remember } from "./service.js";
import { reasonOf } from "./reasons.js";

const REFUSALS = { 401: "wrong_token", 403: "no_orders", 409: "not_now", 422: "not_so", 429: "too_often", 503: "cannot" };

let pending = null;
let isUnderWay = false; // an order that is not answered yet

/** Have it done, one order at a time, after asking who orders it where that is not known.
 *
 * begun() when it is sent; done(answer) or failed(words) with what became of it. byPin: a PIN is proof enough.
 */
export function give(asked) {
  if (isUnderWay) return;
  pending = { byPin: true, ...asked };
  if (isKnown(pending.byPin)) carryOut();
  else openDialog("");
}

async function openDialog(text) {
  say("token-told", text);
  at("token").value = "";
  if (!at("token-dialog").open) at("token-dialog").showModal();
  at("token").focus();
  try {
    fillPeople(pending.byPin ? (await get("/people")).names : []);
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
  const { path, body, begun, done, failed } = pending;
  isUnderWay = true;
  begun();
  try {
    done(await order(path, body));
  } catch (error) {
    if (!(error instanceof Refused)) failed(() => words("transfer_unknown"));
    else failed(() => refusal(error));
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
onLanguage(askedFor);
