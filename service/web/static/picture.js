// The frame with its contour over it: zoom, pan, and where the pointer is in millimetres.

import { at, draw, say } from "./dom.js";
import { drawn as drawnPart } from "./part.js";
import { number, onLanguage, words } from "./words.js";

const STEP = 1.25;
const MOST = 40;
const MOST_MARKS = 400; // more vertices than this are a line of dots
const TEXT_PX = 13;
const LETTER_PX = 36;
const MOST_WAIT_MS = 300;

const view = at("view");
const frame = at("frame");
let drawing = null;
let box = null; // what is seen of the frame: x, y, width, height in its pixels
let withAxes = true;
const pointers = new Map();

let settle = () => {}; // shows at once what waits for its frame

/** Show a job's frame and its drawing; null shows why there is none. Until the frame has come, the job before stays. */
export function show(next, address, why = "no_picture") {
  settle();
  at("no-picture").hidden = next !== null;
  at("no-picture").dataset.t = why;
  say("no-picture", words(why));
  if (!next) {
    drawing = null;
    view.replaceChildren();
    return;
  }
  const same = drawing && drawing.width === next.width && drawing.height === next.height;
  const image = draw("image", { href: address, x: -0.5, y: -0.5, width: next.width, height: next.height, preserveAspectRatio: "none", visibility: "hidden" });
  const swap = () => {
    if (settle !== swap) return;
    settle = () => {};
    drawing = next;
    for (const other of [...view.children]) if (other !== image) other.remove(); // a contour over another job's frame would lie
    image.removeAttribute("visibility");
    view.append(axes(), contour());
    if (same) look();
    else fit();
  };
  settle = swap;
  view.append(image);
  if (!same) swap();
  for (const end of ["load", "error"]) image.addEventListener(end, swap, { once: true });
  setTimeout(swap, MOST_WAIT_MS);
}

function line(points) {
  return `M${points.map(([x, y]) => `${x} ${y}`).join("L")}`;
}

function path(points) {
  return `${line(points)}Z`;
}

function contour() {
  const group = outline();
  for (const points of drawing.shown) {
    for (const name of ["shown-under", "shown"]) group.append(draw("path", { class: name, d: line(points) }));
  }
  return group;
}

function outline() {
  const { width, height } = drawing;
  const cross = draw("path", { class: "cross", d: `M${(width - 1) / 2} -0.5v${height}M-0.5 ${(height - 1) / 2}h${width}` });
  const told = drawing.hidden.length ? "told" : "";
  const group = draw("g", { class: drawing.refused ? `refused ${told}` : "" }, ...(drawing.job_id ? [] : [cross])); // of no job: live
  for (const mark of drawing.sentinels) group.append(draw("path", { class: "sentinel", d: path(mark.corners) }));
  const rings = [drawing.exterior, ...drawing.holes].filter((ring) => ring.length);
  if (!rings.length) return group;
  const all = rings.map(path).join("");
  if (drawing.band_px) group.append(draw("path", { class: "band", d: all, "stroke-width": 2 * drawing.band_px }));
  group.append(draw("path", { class: "under", d: all }));
  for (const hole of drawing.holes) group.append(draw("path", { class: "hole", d: path(hole) }));
  group.append(draw("path", { class: "exterior", d: path(drawing.exterior) }));
  for (const { covered, points } of drawing.hidden) group.append(draw("path", { class: covered ? "covered" : "bridged", d: line(points) }));
  const corners = rings.flat();
  for (const part of drawing.part ? [drawing.part] : drawing.parts) group.append(drawnPart(part, path, drawing.width, drawing.height, !drawing.part));
  if (drawing.ribbon.length) group.append(...ribbon(drawing.ribbon));
  if (corners.length <= MOST_MARKS) group.append(draw("path", { class: "vertices", d: corners.map(([x, y]) => `M${x} ${y}h0`).join("") }));
  return group;
}

/** A line along the core's ribbon, with an L at its end. */
function ribbon(ends) {
  const [x, y] = ends[1];
  const lines = ["ribbon-under", "ribbon"].map((name) => draw("path", { class: name, d: line(ends) }));
  return [...lines, draw("text", { class: "part-number", x, y, "font-size": LETTER_PX }, "L")];
}

function axes() {
  const group = draw("g", { id: "axes" });
  for (const { axis, mm, points } of drawing.axes) {
    group.append(draw("polyline", { class: "axis", points: points.map((point) => point.join(",")).join(" ") }));
    const text = draw("text", { "data-axis": axis, "text-anchor": axis === "x" ? "middle" : "start" }, number(mm, mm % 1 ? 1 : 0));
    text.points = points;
    group.append(text);
  }
  return group;
}

function fit() {
  frame.style.aspectRatio = `${drawing.width} / ${drawing.height}`; // heeded on a narrow screen alone
  box = { x: -0.5, y: -0.5, width: drawing.width, height: drawing.height };
  look();
}

/** Frame pixels for one pixel of the screen. */
function scale() {
  const { width, height } = frame.getBoundingClientRect();
  return Math.max(box.width / width, box.height / height) || 1;
}

function look() {
  if (!drawing) return;
  view.setAttribute("viewBox", `${box.x} ${box.y} ${box.width} ${box.height}`);
  const group = at("axes");
  group.toggleAttribute("hidden", !withAxes);
  group.style.display = withAxes ? "" : "none";
  const size = TEXT_PX * scale();
  for (const text of group.querySelectorAll("text")) place(text, size);
}

/** A line's number where the line enters what is seen: below for x, at the left for y. */
function place(text, size) {
  const isX = text.dataset.axis === "x";
  const bottom = Math.min(box.y + box.height, drawing.height);
  const edge = isX ? bottom - size : Math.max(box.x, 0) + size / 2;
  const found = crossed(text.points, isX ? 1 : 0, edge);
  const crossing = !isX && found?.[1] > bottom - 2 * size ? null : found; // where the numbers of x stand
  text.style.display = crossing ? "" : "none";
  if (!crossing) return;
  text.setAttribute("font-size", size);
  text.setAttribute("x", crossing[0]);
  text.setAttribute("y", crossing[1] + (isX ? size / 2 : -size / 4));
}

function crossed(points, coordinate, edge) {
  for (let k = 1; k < points.length; k += 1) {
    const [a, b] = [points[k - 1], points[k]];
    const [from, to] = [a[coordinate], b[coordinate]];
    if (from !== to && (from - edge) * (to - edge) <= 0) {
      const share = (edge - from) / (to - from);
      return [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
    }
  }
  return null;
}

/** Frame pixels of a place on the screen. */
function pixel(event) {
  const matrix = view.getScreenCTM();
  if (!matrix) return [0, 0];
  const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix.inverse());
  return [point.x, point.y];
}

function zoom(factor, [x, y]) {
  if (!drawing) return;
  const width = Math.min(Math.max(box.width * factor, drawing.width / MOST), drawing.width);
  const ratio = width / box.width;
  box = { x: x - (x - box.x) * ratio, y: y - (y - box.y) * ratio, width, height: box.height * ratio };
  move(0, 0);
}

function move(right, down) {
  if (!drawing) return;
  box.x = Math.min(Math.max(box.x + right, -0.5), drawing.width - 0.5 - box.width);
  box.y = Math.min(Math.max(box.y + down, -0.5), drawing.height - 0.5 - box.height);
  look();
}

const middle = () => [box.x + box.width / 2, box.y + box.height / 2];

/** Millimetres of a frame pixel, between the four nodes around it; null where there are none. */
export function millimetres(shown, x, y) {
  const grid = shown.grid;
  if (!grid) return null;
  const column = ((x + 0.5) / shown.width) * (grid.columns - 1);
  const row = ((y + 0.5) / shown.height) * (grid.rows - 1);
  if (column < 0 || row < 0 || column > grid.columns - 1 || row > grid.rows - 1) return null;
  const left = Math.min(Math.floor(column), grid.columns - 2);
  const top = Math.min(Math.floor(row), grid.rows - 2);
  const [across, down] = [column - left, row - top];
  const node = (c, r, k) => grid.millimetres[2 * (r * grid.columns + c) + k];
  const at = (k) =>
    (1 - down) * ((1 - across) * node(left, top, k) + across * node(left + 1, top, k)) +
    down * ((1 - across) * node(left, top + 1, k) + across * node(left + 1, top + 1, k));
  return [at(0), at(1)];
}

function tell(event) {
  const [x, y] = pixel(event);
  if (!drawing || x < -0.5 || y < -0.5 || x > drawing.width - 0.5 || y > drawing.height - 0.5) {
    at("cursor").textContent = "";
    return;
  }
  const found = millimetres(drawing, x, y);
  const [key, values] = found ? ["cursor", found] : ["cursor_px", [x, y]];
  at("cursor").textContent = words(key, { x: number(values[0], 1), y: number(values[1], 1) });
}

function dragged(event) {
  const before = pointers.get(event.pointerId);
  if (!before) return;
  const others = [...pointers.entries()].filter(([id]) => id !== event.pointerId);
  pointers.set(event.pointerId, event);
  if (others.length) {
    const other = others[0][1];
    const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY) || 1;
    zoom(apart(before) / apart(event), pixel({ clientX: (event.clientX + other.clientX) / 2, clientY: (event.clientY + other.clientY) / 2 }));
  } else {
    const [from, to] = [pixel(before), pixel(event)];
    move(from[0] - to[0], from[1] - to[1]);
  }
}

view.addEventListener("wheel", (event) => {
  event.preventDefault();
  if (drawing) zoom(event.deltaY > 0 ? STEP : 1 / STEP, pixel(event));
}, { passive: false });
view.addEventListener("pointerdown", (event) => {
  pointers.set(event.pointerId, event);
  view.setPointerCapture(event.pointerId);
});
view.addEventListener("pointermove", (event) => {
  dragged(event);
  tell(event);
});
for (const name of ["pointerup", "pointercancel"]) view.addEventListener(name, (event) => pointers.delete(event.pointerId));
view.addEventListener("pointerleave", () => (at("cursor").textContent = ""));

const KEYS = {
  "+": () => zoom(1 / STEP, middle()), "=": () => zoom(1 / STEP, middle()), "-": () => zoom(STEP, middle()), 0: fit,
  ArrowLeft: () => move(-box.width / 8, 0), ArrowRight: () => move(box.width / 8, 0),
  ArrowUp: () => move(0, -box.height / 8), ArrowDown: () => move(0, box.height / 8),
};
frame.addEventListener("keydown", (event) => {
  if (!drawing || !KEYS[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  event.stopPropagation();
  KEYS[event.key]();
});
at("zoom-in").addEventListener("click", () => drawing && zoom(1 / STEP ** 2, middle()));
at("zoom-out").addEventListener("click", () => drawing && zoom(STEP ** 2, middle()));
at("zoom-fit").addEventListener("click", () => drawing && fit());
at("millimetres").addEventListener("click", () => {
  withAxes = !withAxes;
  at("millimetres").setAttribute("aria-pressed", withAxes);
  look();
});
new ResizeObserver(look).observe(frame);
onLanguage(() => drawing && at("axes") && look());
