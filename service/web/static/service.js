// The service, by its REST interface: what is asked, what comes by itself, and the token or PIN of whoever gives orders.

import { learn } from "./words.js";

const BASE = "/api/v1";
const FORGOTTEN_MS = 600_000;
const SILENT_MS = 3_500;
const AGAIN_MS = 2_000;
const ORDER_MS = 15_000; // the service answers within 10 s, if at all

let proof = null; // of who gives orders: what goes into Authorization
let forgetting = null;

export class Refused extends Error {
  constructor(status, problem) {
    super(problem.error);
    learn(problem);
    this.status = status;
    this.code = problem.code;
    this.holder = problem.holder;
  }
}

export async function get(path) {
  const answer = await fetch(BASE + path, { cache: "no-store" });
  if (!answer.ok) throw new Refused(answer.status, await answer.json());
  return learn(await answer.json());
}

/** True where who gives orders is known; a PIN only where it is enough. */
export function isKnown(byPin = true) {
  return proof !== null && (byPin || proof.startsWith("Bearer "));
}

export function remember(value) {
  proof = value;
  clearTimeout(forgetting);
  forgetting = setTimeout(forget, FORGOTTEN_MS);
}

export function forget() {
  proof = null;
}

export async function order(path, body) {
  const headers = { "Content-Type": "application/json", Authorization: proof };
  const answer = await fetch(BASE + path, { method: "POST", headers, body: JSON.stringify(body), signal: AbortSignal.timeout(ORDER_MS) });
  const told = await answer.json();
  if (answer.status === 401) forget();
  if (!answer.ok) throw new Refused(answer.status, told);
  remember(proof);
  return told;
}

/** Calls `heard` with each state, and `lost` once nothing is heard for some seconds or the connection breaks. */
export function listen(heard, lost) {
  let source = null;
  let silence = null;
  let isLost = false;
  const lose = () => {
    if (!isLost) lost();
    isLost = true;
  };
  const open = () => {
    source = new EventSource(`${BASE}/events`);
    source.onmessage = (event) => {
      clearTimeout(silence);
      silence = setTimeout(lose, SILENT_MS);
      isLost = false;
      heard(learn(JSON.parse(event.data)));
    };
    source.onerror = () => {
      lose();
      source.close();
      setTimeout(open, AGAIN_MS);
    };
  };
  silence = setTimeout(lose, SILENT_MS);
  open();
}
