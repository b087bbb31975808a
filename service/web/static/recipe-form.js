// A form for a recipe, made from its JSON schema: a control for each key that may be changed.

import { at, make } from "./dom.js";
import { words } from "./words.js";

let schema = null;
let values = {};
let controls = new Map(); // by key: how its value is read, and what shows that it is another one

/** The bounds and words of recipes' keys. */
export function use(next) {
  schema = next;
}

/** Show a recipe's values, with the edits of `edited` in them. */
export function show(recipe, edited = {}) {
  values = recipe.values;
  controls = new Map();
  const groups = new Map([["", []]]);
  for (const key of Object.keys(values)) {
    const group = key.includes(".") ? key.slice(0, key.lastIndexOf(".")) : "";
    if (!groups.has(group)) groups.set(group, []);
    groups.get(group).push(control(key, key in edited ? edited[key] : values[key]));
  }
  const shown = [...groups].map(([group, made]) => (group ? [make("fieldset", {}, make("legend", {}, legend(group, recipe.parts)), ...made)] : made));
  at("keys-of").replaceChildren(...shown.flat());
  mark();
}

function legend(group, parts) {
  const [name, place] = group.split(".");
  const file = name === "part" ? parts[0] : name === "parts" ? parts[Number(place)] : null;
  return file ? `${group}: ${file}` : group;
}

/** The keys that are set otherwise, with their values. */
export function changes() {
  return Object.fromEntries([...controls].map(([key, { read }]) => [key, read()]).filter(([key, value]) => !same(value, values[key])));
}

const same = (one, other) => JSON.stringify(one) === JSON.stringify(other);

/** Show which keys are set otherwise, and what they were. */
export function mark() {
  const changed = changes();
  for (const [key, { field, was }] of controls) {
    const isChanged = key in changed;
    field.classList.toggle("changed", isChanged);
    was.textContent = isChanged ? words("was", { value: text(values[key]) }) : "";
  }
  return Object.keys(changed).length > 0;
}

export const text = (value) => (typeof value === "string" ? value : value === null ? words("nothing") : JSON.stringify(value));

/** What the schema says of a key: of the kinds that it may be of, none is left out where there are several. */
function described(key) {
  let here = schema;
  for (const part of key.split(".")) here = whole(/^\d+$/.test(part) ? here.items : here.properties[part]);
  return here;
}

function whole(one) {
  if (one.$ref) return schema.$defs[one.$ref.split("/").at(-1)];
  const kinds = one.anyOf?.filter(({ type }) => type !== "null") ?? [];
  return kinds.length === 1 ? { ...whole(kinds[0]), description: one.description, isOptional: true } : one;
}

function control(key, value) {
  const about = described(key);
  const was = make("small", {});
  const { made, read } = about.items?.enum ? boxes(about, value) : about.enum ? choice(about, value) : entry(key, about, value);
  const label = [make("span", {}, words(about.description ?? key), make("code", {}, key))];
  const field = made.tagName === "FIELDSET" ? make("div", { class: "key" }, ...label, made, was) : make("label", { class: "key" }, ...label, made, was);
  if (made.tagName === "FIELDSET") made.setAttribute("aria-label", words(about.description ?? key));
  controls.set(key, { read, field, was });
  return field;
}

function choice({ enum: known }, value) {
  const made = make("select", {}, ...known.map((one) => make("option", { value: one }, one)));
  made.value = value;
  return { made, read: () => made.value };
}

function boxes({ items }, value) {
  const all = items.enum.map((one) => {
    const box = make("input", { type: "checkbox", value: one });
    box.checked = value.includes(one);
    return box;
  });
  const made = make("fieldset", { class: "boxes" }, ...all.map((box) => make("label", {}, box, box.value)));
  const order = (chosen) => [...value.filter((one) => chosen.includes(one)), ...chosen.filter((one) => !value.includes(one))];
  return { made, read: () => order(all.filter((box) => box.checked).map((box) => box.value)) };
}

function entry(key, about, value) {
  const isNumber = about.type === "number" || about.type === "integer";
  const isText = about.type === "string";
  const made = make("input", { type: isNumber ? "number" : "text", autocomplete: "off", spellcheck: "false" });
  if (isNumber) {
    made.step = about.type === "integer" ? 1 : "any";
    for (const [name, bound] of [["min", about.minimum ?? about.exclusiveMinimum], ["max", about.maximum ?? about.exclusiveMaximum]]) {
      if (bound !== undefined) made[name] = bound;
    }
    made.required = !about.isOptional;
  }
  if (isText && about.maxLength) made.maxLength = about.maxLength;
  made.value = value === null ? "" : typeof value === "string" ? value : JSON.stringify(value);
  const shown = [made];
  const known = about.anyOf?.flatMap((kind) => kind.enum ?? []) ?? [];
  if (known.length) {
    made.setAttribute("list", `known-${key}`);
    shown.push(make("datalist", { id: `known-${key}` }, ...known.map((one) => make("option", { value: one }))));
  }
  const read = () => (made.value === "" && !isText ? null : isText ? made.value : plain(made.value));
  return { made: shown.length > 1 ? make("div", {}, ...shown) : made, read };
}

/** A number, list or the like where it is written as JSON has it, else the words as they stand; the service judges. */
function plain(written) {
  try {
    return JSON.parse(written);
  } catch {
    return written;
  }
}
