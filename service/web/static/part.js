// The part laid into the block: drawn with the margin that it needs and its tightest place; and what another margin would do.

import { at, draw, make, say } from "./dom.js";
import { amount, onLanguage, words } from "./words.js";

const LEAST_MM = 10; // the slider goes that far at least
const NUMBER_PX = 36;

let part = null;
let clips = 0; // each part has a clip path of its own
let set = null; // the part that the slider is set for, as text

/** Show what the part of a job needs; null where it has none. The slider stays while a job is shown anew. */
export function show(next) {
  part = next;
  at("part").hidden = part === null;
  if (!isSetFor(part)) {
    set = JSON.stringify(part);
    const slider = at("part-margin");
    slider.max = Math.ceil(Math.max(LEAST_MM, 2 * (part?.asked_mm ?? 0), 1.5 * (part?.margin_mm ?? 0)));
    slider.value = part?.asked_mm ?? 0;
  }
  refresh();
}

function isSetFor(one) {
  return JSON.stringify(one) === set;
}

function needed(one) {
  const asked = isSetFor(one) ? Number(at("part-margin").value) : one.asked_mm;
  return asked + one.needed_mm - one.asked_mm;
}

/** Show how many of several parts were laid, each with the least margin among them. */
export function list(parts, wanted) {
  at("laid").hidden = !parts.length;
  at("laid").replaceChildren(...wanted.map((one) => {
    const own = parts.filter(({ number }) => number === one.number);
    const margin = amount(Math.min(...own.map((part) => part.margin_mm)), "mm", 2);
    const text = words(own.length ? "parts_laid" : "parts_not_laid", { part: one.number, file: one.file, laid: own.length, wanted: one.quantity, margin });
    return make("li", { "data-kind": own.length < one.quantity ? "short" : "all" }, text);
  }));
}

/** What is drawn of a part over the frame, with its path by `path`, in a picture of that width and height. */
export function drawn(part, path, width, height, several) {
  const rings = [part.exterior, ...part.holes].map(path).join("");
  const [[x, y], [u, v]] = part.tightest;
  // The margin lies around the material, never in it.
  const clip = `part-outside-${++clips}`;
  const outside = draw("path", { d: `M-1 -1H${width}V${height}H-1Z${rings}`, "clip-rule": "evenodd" });
  return draw("g", { class: part.fits ? "part" : "part short" },
    draw("clipPath", { id: clip }, outside),
    draw("path", { class: "part-margin", d: rings, "stroke-width": veil(part), "clip-path": `url(#${clip})` }),
    draw("path", { class: "part-under", d: rings }),
    draw("path", { class: "part-outline", d: rings }),
    draw("path", { class: "part-tightest", d: `M${x} ${y}L${u} ${v}` }),
    ...(several ? [numbered(part)] : []));
}

function numbered(part) {
  const [x, y] = part.middle;
  return draw("text", { class: "part-number", x, y, "font-size": NUMBER_PX }, String(part.number));
}

function veil(of) {
  return Math.max(2 * needed(of) * of.px_per_mm, 0);
}

/** Only the margin asked for changes: the part already lies where its least margin is largest. */
function refresh() {
  if (!part) return;
  const asked = Number(at("part-margin").value);
  const short = needed(part) - part.margin_mm;
  const values = { margin: amount(asked, "mm", 1), reached: amount(part.margin_mm, "mm", 2), short: amount(Math.max(short, 0), "mm", 2) };
  at("part-told").dataset.kind = short > 0 ? "refused" : "accepted";
  say("part-told", short > 0 ? words("part_short", values) : words("part_fits", values));
  document.querySelector("#view .part-margin")?.setAttribute("stroke-width", veil(part));
}

at("part-margin").addEventListener("input", refresh);
onLanguage(refresh);
