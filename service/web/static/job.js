// One job with all its values: how it ended, why, what was measured, what it took, and its files.

import { at, make, say } from "./dom.js";
import { amount, moment, number, onLanguage, seenAs, words } from "./words.js";
import { ORIGINS, current } from "./now.js";
import { reasonOf } from "./reasons.js";
import { list as listParts, show as showPart } from "./part.js";

const STAGES = ["frame", "table", "mask", "trace", "quality", "convert", "simplify", "judge", "guard", "part", "pages", "transfer", "total"];
const WIDE = ["uncertainty", "recipe", "when", "origin"]; // a line of their own

let job = null;
let drawing = null;

export function show(next, nextDrawing) {
  job = next;
  drawing = nextDrawing;
  refresh();
}

function refresh() {
  if (!job) return;
  const kind = job.outcome ?? "running";
  at("verdict").dataset.kind = kind;
  at("verdict").querySelector("use").setAttribute("href", `#s-${job.outcome ?? "busy"}`);
  say("outcome", `${words("job_runs", { job: job.job_id })}: ${words(kind)}`);
  because();
  values();
  showPart(drawing?.part ?? null);
  listParts(drawing?.parts ?? [], drawing?.wanted ?? []);
  stages();
  downloads();
}

function because() {
  const isTold = current()?.last_job?.job === job.job_id; // above, and larger
  const told = job.reason === null || isTold ? null : reasonOf(job.reason);
  const parts = told ? [make("strong", {}, told.sentence), ` ${told.next_action}`] : [];
  if (job.detail) parts.push(make("small", {}, `${job.reason ?? ""} ${job.reason_name ?? ""} ${seenAs(job.detail)}`.trim()));
  at("because").hidden = !parts.length;
  at("because").replaceChildren(...parts);
}

function values() {
  const { report } = job;
  const size = drawing?.size_mm;
  const sure = report.uncertainty_mm;
  const rows = [
    ["area", report.area_mm2 == null ? null : amount(report.area_mm2, "mm²")],
    ["vertices", report.vertices ? number(report.vertices) : null],
    ["size", size ? `${number(size[0], 1)} × ${amount(size[1], "mm", 1)}` : null],
    ["thickness", report.thickness_mm == null ? null : amount(report.thickness_mm, "mm", 1)],
    ["uncertainty", report.vertices ? (sure == null ? words("not_known") : `± ${amount(sure, "mm", 2)}`) : null],
    ["recipe", [job.recipe ? `${job.recipe.number} ${job.recipe.name}` : job.trigger.recipe || null, report.method].filter(Boolean).join(", ") || null],
    ["when", moment(job.settled_at ?? job.taken_at)],
    ["origin", words(ORIGINS[job.trigger.kind] ?? job.trigger.kind)],
  ];
  const shown = rows.filter(([, value]) => value !== null);
  const wide = (key) => (WIDE.includes(key) ? { class: "wide" } : {});
  at("values").replaceChildren(...shown.flatMap(([key, value]) => [make("dt", wide(key), words(key)), make("dd", wide(key), String(value))]));
}

function stages() {
  const { report } = job;
  const times = { ...report.timings_ms };
  delete times.total;
  for (const name of ["frame", "pages", "transfer", "total"]) if (report[`${name}_ms`] != null) times[name] = report[`${name}_ms`];
  const names = [...STAGES.filter((name) => name in times), ...Object.keys(times).filter((name) => !STAGES.includes(name))];
  const longest = Math.max(...Object.values(times), 1);
  const rows = names.flatMap((name) => {
    const bar = make("div", { class: "bar" });
    bar.style.width = `${(100 * times[name]) / longest}%`;
    return [make("dt", {}, words(name)), bar, make("dd", {}, amount(times[name], "ms", times[name] < 10 ? 1 : 0))];
  });
  at("stages").replaceChildren(...rows);
}

function downloads() {
  const links = job.files.map((name) => make("a", { href: `/api/v1/jobs/${job.job_id}/files/${name}`, download: "" }, name));
  at("downloads").replaceChildren(...(links.length ? [`${words("downloads")} `, ...links] : []));
}

onLanguage(refresh);
