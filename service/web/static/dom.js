// Small helpers to make elements; texts are always set as text, never as markup.

export const at = (id) => document.getElementById(id);

/** An element with attributes and children; strings become text. */
export function make(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

const SVG = "http://www.w3.org/2000/svg";

export function draw(name, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** The shape that goes with a kind of state or outcome. */
export function shape(kind) {
  return draw("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, draw("use", { href: `#s-${kind}` }));
}

export function say(id, text) {
  const element = at(id);
  if (element.textContent !== text) element.textContent = text; // a screen reader would read it again
}
