// The operator's page: puts its parts together. It uses nothing but the REST interface under /api/v1.

import { at, make, say } from "./dom.js";
import { load, onLanguage, words } from "./words.js";
import { listen } from "./service.js";
import { insist, paced } from "./pace.js";
import { loadReasons } from "./reasons.js";
import { switchLanguage, switchTheme } from "./reader.js";
import * as film from "./film.js";
import * as live from "./live.js";
import * as now from "./now.js";
import * as orders from "./orders.js";

const ready = Promise.all([insist(load, now.lose), insist(loadReasons, now.lose)]);
let seen = "";
// Two for a job that ends and is kept; a machine of five jobs a second is not held up by who watches it.
const lookSoon = paced(film.refresh, 2, 500);

function heard(state) {
  now.show(state);
  orders.show(state);
  const newest = `${state.last_job?.job} ${state.settled_job} ${state.disk.archive_jobs}`; // not a job's begin: nothing disturbs it
  if (newest !== seen) lookSoon();
  seen = newest;
}

function lost() {
  seen = "";
  now.lose();
  orders.allow(null);
}

async function changeLanguage() {
  await ready;  // a key may come before the words
  switchLanguage();
}

function help() {
  const rows = [["M", "key_m"], ["V", "key_v"], ["F", "key_f"], ["R", "key_r"], ["← →", "key_arrows"], ["+ − 0", "key_zoom"], ["L", "key_l"], ["T", "key_t"], ["Esc", "key_esc"]];
  at("keys").replaceChildren(...rows.flatMap(([key, text]) => [make("dt", {}, key), make("dd", {}, words(text))]));
  say("version", words("service_version", { version: now.current()?.version ?? "–", host: location.host }));
  if (!at("help-dialog").open) at("help-dialog").showModal();
}

// By the key's place, so that they work under a Russian layout too.
const KEYS = {
  KeyM: orders.measure, KeyV: live.toggle, KeyF: past(film.freeze), KeyR: past(film.toggleRefused), KeyL: changeLanguage, KeyT: switchTheme, Slash: help,
  ArrowLeft: past(() => film.go(-1)), ArrowRight: past(() => film.go(1)), Escape: past(film.live),
};

/** The action, after the live view has ended. */
function past(action) {
  return () => {
    live.end();
    action();
  };
}

document.addEventListener("keydown", (event) => {
  const busy = event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]");
  const held = event.repeat && !event.code.startsWith("Arrow"); // a key that is held down is one order, not thirty a second
  if (busy || held || /^(INPUT|SELECT)$/.test(event.target.tagName) || !KEYS[event.code]) return;
  event.preventDefault();
  KEYS[event.code]();
});
at("language").addEventListener("click", changeLanguage);
at("help").addEventListener("click", help);
onLanguage(() => at("help-dialog").open && help());

await ready;
for (const control of document.querySelectorAll(":disabled")) if (!control.closest("#orders")) control.disabled = false; // whoever pressed sooner would wait in vain
listen(heard, lost);
