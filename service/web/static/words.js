// Words, numbers and times in the language that is chosen; changing it changes the page where it stands.

let texts = {};
let language = document.documentElement.lang;
const listeners = [];

/** The words of the pages, and of one page's own files; `described` are sentences that the service has in English alone. */
export async function load(...more) {
  const told = await Promise.all(["texts.json", ...more].map(async (name) => (await fetch(`/static/${name}`)).json()));
  texts = { en: Object.assign({}, ...told.map(({ en }) => en)), ru: Object.assign({}, ...told.flatMap(({ ru, described }) => [ru, described])) };
}

export function chosen() {
  return language;
}

/** The words of a key, with {name} filled in; dots as long as there are none. */
export function words(key, values = {}) {
  if (!texts[language]) return "…";
  const text = texts[language][key] ?? key;
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name]);
}

const MOST_KNOWN = 2_000;
const inRussian = new Map(); // sentences of what was seen, by the English ones

/** Keep what an answer's own sentences, and those of its jobs, are in Russian. */
export function learn(answer) {
  if (inRussian.size > MOST_KNOWN) inRussian.clear();
  for (const one of [answer, ...(answer.jobs ?? [])]) for (const [english, russian] of Object.entries(one.ru ?? {})) inRussian.set(english, russian);
  return answer;
}

/** A sentence of what was seen, in the chosen language where that is known. */
export function seenAs(text) {
  return language === "ru" ? inRussian.get(text) ?? text : text;
}

export function onLanguage(listener) {
  listeners.push(listener);
}

export function keep(name, value) {
  document.cookie = `${name}=${value}; Path=/; SameSite=Strict; Max-Age=31536000${location.protocol === "https:" ? "; Secure" : ""}`;
}

export function choose(next) {
  language = next;
  document.documentElement.lang = next;
  keep("language", next);
  for (const element of document.querySelectorAll("[data-t]")) element.textContent = words(element.dataset.t);
  for (const element of document.querySelectorAll("[data-a]")) element.setAttribute("aria-label", words(element.dataset.a));
  const other = next === "en" ? "ru" : "en";
  const button = document.getElementById("language");
  button.textContent = texts[other].name;
  button.lang = other;
  for (const listener of listeners) listener();
}

export function number(value, digits = 0) {
  return value.toLocaleString(language, { minimumFractionDigits: digits, maximumFractionDigits: digits });
}

const UNITS = { ru: { mm: "мм", "mm²": "мм²", ms: "мс", MB: "МБ", GB: "ГБ", TB: "ТБ" } };

/** A number with its unit, kept on one line; "not known" where there is none. */
export function amount(value, unit, digits = 0) {
  if (value === null || value === undefined) return words("not_known");
  return `${number(value, digits)}\u00a0${UNITS[language]?.[unit] ?? unit}`;
}

export function bytes(value) {
  const [size, unit] = value >= 1e12 ? [1e12, "TB"] : value >= 1e9 ? [1e9, "GB"] : [1e6, "MB"];
  return amount(value / size, unit, value / size < 10 ? 1 : 0);
}

/** A moment in local time; its day only where it is not today. */
export function moment(text) {
  const when = new Date(text);
  const time = when.toLocaleTimeString(language, { hourCycle: "h23" });
  return when.toDateString() === new Date().toDateString() ? time : `${when.toLocaleDateString(language, { dateStyle: "medium" })} ${time}`;
}

/** Seconds as people say them: the two largest units. */
export function duration(seconds) {
  const told = [];
  let left = Math.floor(seconds);
  for (const [size, unit] of [[86400, "days"], [3600, "hours"], [60, "minutes"], [1, "seconds"]]) {
    const count = Math.floor(left / size);
    left -= count * size;
    if (count || (unit === "seconds" && !told.length)) told.push(words(unit, { n: count }));
  }
  return told.slice(0, 2).join(" ");
}
