// How somebody reads a page: the buttons of language and theme.

import { at } from "./dom.js";
import { choose, chosen, keep } from "./words.js";

const THEMES = { auto: "dark", dark: "light", light: "auto" };

export function switchLanguage() {
  choose(chosen() === "en" ? "ru" : "en");
}

export function switchTheme() {
  const root = document.documentElement;
  root.dataset.theme = THEMES[root.dataset.theme];
  keep("theme", root.dataset.theme);
}

at("theme").addEventListener("click", switchTheme);
