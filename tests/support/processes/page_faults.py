"""What is wrong with a page, asked in the browser."""

from __future__ import annotations

# What is wrong with what is drawn now, in words.
FAULTS = """() => {
  const wrong = [];
  if (document.documentElement.scrollWidth > innerWidth) wrong.push(`${document.documentElement.scrollWidth} px wide`);
  for (const one of document.querySelectorAll("button, select, input, summary, a")) {
    if (!one.checkVisibility()) continue;
    const name = one.getAttribute("aria-label") || one.textContent.trim() || one.labels?.[0]?.textContent;
    if (!name) wrong.push(`no name: ${one.outerHTML}`);
    const box = one.getBoundingClientRect();
    const inStrip = one.closest("#strip");
    if (!inStrip && (box.left < 0 || box.right > innerWidth + 0.5)) wrong.push(`out of sight: ${one.outerHTML}`);
  }
  for (const id of ["last-word", "state"]) {
    const one = document.getElementById(id);
    if (!one) continue;
    if (one.scrollWidth > one.clientWidth + 1) wrong.push(`cut off: ${one.textContent}`);
  }
  for (const id of ["last-word", "state", "trigger", "halt", "resume"]) {
    const one = document.getElementById(id);
    if (!one) continue;
    const seen = ["halt", "resume"].includes(id) ? !one.hidden : true;
    if (seen && !one.textContent.trim()) wrong.push(`no words: ${id}`);
  }
  return wrong;
}"""
# What axe-core, which must be there, finds serious.
AXE = """async () => {
  const told = await axe.run(document, { resultTypes: ["violations"] });
  return told.violations.filter(({ impact }) => ["serious", "critical"].includes(impact))
    .map(({ id, nodes }) => `${id}: ${nodes.map((node) => node.target).join(" ")}`);
}"""
