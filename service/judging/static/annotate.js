// The true outline of a picture, drawn with the mouse.

import { at, draw, make, say } from "./dom.js";
import { LEAST, Rings } from "./rings.js";

const REACH_PX = 8; // of the screen, around a vertex or an edge
const STILL_PX = 4; // a press that moves less is a click
const STEP = 1.2;
const MOST = 100;

const view = at("view");
let pictures = [];
let number = 0;
let size = { width: 1, height: 1 };
let box = { x: -0.5, y: -0.5, width: 1, height: 1 }; // what is seen of the picture, in its pixels
let rings = new Rings();
let held = null; // what the pressed button drags: a vertex, or the picture
let saved = true;

/** What the server answers; throws with its words. */
async function ask(path, content) {
  const options = content ? { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(content) } : {};
  const answer = await fetch(path, options);
  const told = await answer.json();
  if (!answer.ok) throw new Error(told.error);
  return told;
}

/** Do it, and tell what went wrong. */
async function attempt(what) {
  try {
    await what();
  } catch (error) {
    say("said", error.message);
  }
}

async function open(next) {
  number = next;
  rings = new Rings();
  saved = true;
  at("edge").value = "";
  say("said", "");
  const address = `pictures/${number}/image`;
  const image = draw("image", { href: address, x: -0.5, y: -0.5 });
  view.replaceChildren(image, draw("g", { id: "rings" }));
  show();
  const probe = new Image();
  probe.src = address;
  await Promise.all([measured(probe, image), attempt(() => take(`pictures/${next}/truth`, next))]);
}

async function measured(probe, image) {
  try {
    await probe.decode();
  } catch {
    return say("said", "the picture cannot be shown");
  }
  if (!image.isConnected) return undefined; // another picture was chosen meanwhile
  size = { width: probe.naturalWidth, height: probe.naturalHeight };
  image.setAttribute("width", size.width);
  image.setAttribute("height", size.height);
  return whole();
}

/** Take the outline of an address over; one that comes for a picture no longer shown is left. */
async function take(path, wanted) {
  const told = await ask(path);
  if (wanted !== number) return null;
  rings = new Rings(told.outer.length ? [told.outer, ...told.holes] : []);
  if (told.edge) at("edge").value = told.edge;
  show();
  return told;
}

function line({ points, closed }) {
  return points.length ? `M${points.map(([x, y]) => `${x} ${y}`).join("L")}${closed ? "Z" : ""}` : "";
}

const dots = (points) => points.map(([x, y]) => `M${x} ${y}h0`).join("");

function show() {
  const all = rings.rings.map(line).join("");
  const parts = rings.rings.map((ring) => draw("path", { class: ring.closed ? "ring" : "open", d: line(ring) }));
  const chosen = rings.chosen ? [rings.chosen.ring.points[rings.chosen.index]] : [];
  at("rings").replaceChildren(
    draw("path", { class: "under", d: all }),
    ...parts,
    draw("path", { class: "vertices", d: dots(rings.rings.flatMap((ring) => ring.points)) }),
    draw("path", { class: "chosen", d: dots(chosen) }),
  );
}

function changed() {
  saved = false;
  say("said", "not saved");
  show();
}

// --- what is seen -----------------------------------------------------------------------------------------------------

function look() {
  view.setAttribute("viewBox", `${box.x} ${box.y} ${box.width} ${box.height}`);
}

function whole() {
  box = { x: -0.5, y: -0.5, ...size };
  look();
}

/** Picture pixels of a place on the screen. */
function pixel(event) {
  const point = new DOMPoint(event.clientX, event.clientY).matrixTransform(view.getScreenCTM().inverse());
  return [Math.round(point.x * 100) / 100, Math.round(point.y * 100) / 100];
}

/** Picture pixels for so many of the screen. */
const reach = (px) => px / view.getScreenCTM().a;

view.addEventListener("wheel", (event) => {
  event.preventDefault();
  const [x, y] = pixel(event);
  const width = Math.min(Math.max(box.width * (event.deltaY > 0 ? STEP : 1 / STEP), size.width / MOST), 2 * size.width);
  const ratio = width / box.width;
  box = { x: x - (x - box.x) * ratio, y: y - (y - box.y) * ratio, width, height: box.height * ratio };
  look();
}, { passive: false });

// --- drawing ----------------------------------------------------------------------------------------------------------

view.addEventListener("pointerdown", (event) => {
  if (event.button !== 0) return;
  view.setPointerCapture(event.pointerId);
  const point = pixel(event);
  const vertex = rings.vertexAt(point, reach(REACH_PX));
  const edge = vertex ? null : rings.edgeAt(point, reach(REACH_PX));
  held = { vertex, from: event, moved: false };
  if (edge) {
    rings.insert(edge, point);
    held.vertex = edge;
    changed();
  } else if (vertex) {
    rings.chosen = vertex;
    show();
  }
});

view.addEventListener("pointermove", (event) => {
  if (!held) return;
  held.moved ||= Math.hypot(event.clientX - held.from.clientX, event.clientY - held.from.clientY) >= STILL_PX;
  if (!held.moved) return;
  if (held.vertex) {
    rings.move(held.vertex, pixel(event));
    changed();
  } else {
    box.x -= reach(event.clientX - (held.last ?? held.from).clientX);
    box.y -= reach(event.clientY - (held.last ?? held.from).clientY);
    held.last = event;
    look();
  }
});

view.addEventListener("pointerup", (event) => {
  if (!held) return;
  const { vertex, moved } = held;
  held = null;
  if (moved) return;
  if (!vertex && rings.open) {
    rings.append(pixel(event));
    changed();
  } else if (vertex && vertex.ring === rings.open && vertex.index === 0) {
    closeRing();
  }
});
view.addEventListener("pointercancel", () => (held = null));

view.addEventListener("contextmenu", (event) => {
  event.preventDefault();
  const vertex = rings.vertexAt(pixel(event), reach(REACH_PX));
  if (!vertex) return;
  rings.take(vertex);
  changed();
});

function closeRing() {
  rings.close();
  changed();
}

addEventListener("keydown", (event) => {
  if (event.target.closest("select, button")) return;
  if (event.key === "Enter") closeRing();
  if ((event.key === "Delete" || event.key === "Backspace") && rings.chosen) {
    rings.take(rings.chosen);
    changed();
  }
});

// --- buttons ----------------------------------------------------------------------------------------------------------

at("ours").addEventListener("click", () => attempt(async () => {
  if (!saved && !confirm("What is drawn is not saved. Replace it?")) return;
  say("said", "tracing…");
  const told = await take(`pictures/${number}/contour`, number);
  if (!told) return;
  changed();
  if (told.findings.length) say("said", `not saved; refused: ${told.findings.join("; ")}`);
}));

at("hole").addEventListener("click", () => {
  if (rings.open) return say("said", "close the ring that is open first");
  rings.begin();
  return say("said", "click around the hole");
});

at("remove").addEventListener("click", () => {
  const ring = rings.chosen?.ring ?? rings.open;
  if (!ring) return say("said", "click on a vertex of the ring first");
  rings.drop(ring);
  return changed();
});

at("edge").addEventListener("change", changed);
at("whole").addEventListener("click", whole);

at("save").addEventListener("click", () => attempt(async () => {
  if (rings.open) throw new Error(`close the ring first; it needs ${LEAST} vertices`);
  if (!at("edge").value) throw new Error("choose the edge first");
  const [outer, ...holes] = rings.rings.map((ring) => ring.points);
  const wanted = number;
  const told = await ask(`pictures/${wanted}/truth`, { outer, holes, edge: at("edge").value });
  pictures[wanted].drawn = true;
  list();
  if (wanted !== number) return;
  saved = true;
  say("said", `saved ${told.saved}`);
}));

function list() {
  at("picture").replaceChildren(...pictures.map((one, k) => make("option", { value: k }, `${one.drawn ? "✓ " : ""}${one.name}`)));
  at("picture").value = number;
}

at("picture").addEventListener("change", () => {
  if (!saved && !confirm("What is drawn is not saved. Leave it?")) {
    at("picture").value = number;
    return;
  }
  open(Number(at("picture").value));
});
addEventListener("beforeunload", (event) => saved || event.preventDefault());

attempt(async () => {
  pictures = await ask("pictures");
  list();
  await open(0);
});
