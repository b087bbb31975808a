// The table of reasons: what a code means, and what to do.

import { chosen } from "./words.js";
import { get } from "./service.js";

let reasons = new Map();

export async function loadReasons() {
  const told = await get("/reasons");
  reasons = new Map(told.reasons.map((entry) => [entry.code, entry]));
}

/** Sentence and next action of a reason's code, in the chosen language. */
export function reasonOf(code) {
  return reasons.get(code)?.[chosen()] ?? null;
}

/** The sentence of a reason by its name; the name where there is none. */
export function sentenceOf(name) {
  const entry = [...reasons.values()].find((one) => one.name === name);
  return entry?.[chosen()]?.sentence ?? name;
}
