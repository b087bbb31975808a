// The page asks for itself each second and takes over what is new: the server alone knows how a cell is shown.

const PERIOD_MS = 1000;
const BOUND_MS = 3000;

function takeOver(name, fresh) {
  const old = document.getElementById(name);
  const found = fresh.getElementById(name);
  if (old.textContent !== found.textContent) old.replaceChildren(...document.adoptNode(found).childNodes);
}

function takeOverRows(fresh) {
  const body = document.getElementById("cells");
  const known = new Map([...body.rows].map((row) => [row.id, row]));
  const rows = [...fresh.getElementById("cells").rows].map((row) => {
    const old = known.get(row.id);
    return old && old.isEqualNode(row) ? old : document.adoptNode(row);
  });
  if (rows.length !== body.rows.length || rows.some((row, at) => row !== body.rows[at])) body.replaceChildren(...rows);
}

async function look() {
  let here = false;
  try {
    const answer = await fetch(location.href, { signal: AbortSignal.timeout(BOUND_MS), cache: "no-store" });
    if (answer.ok) {
      const fresh = new DOMParser().parseFromString(await answer.text(), "text/html");
      takeOver("summary", fresh);
      takeOverRows(fresh);
      here = true;
    }
  } catch {
    // the server does not answer: told below
  }
  document.getElementById("lost").hidden = here;
  document.body.classList.toggle("stale", !here);
  setTimeout(look, PERIOD_MS);
}

setTimeout(look, PERIOD_MS);
