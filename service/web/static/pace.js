// A pace for what would else be done as often as it is asked for.

/** Has `action` done soon after a call: `most` times at once, then once each `period` ms; calls meanwhile become one. */
export function paced(action, most, period) {
  let left = most;
  let countedAt = performance.now();
  let timer = null;
  const act = () => {
    timer = null;
    left -= 1;
    action();
  };
  return () => {
    const now = performance.now();
    left = Math.min(left + (now - countedAt) / period, most);
    countedAt = now;
    timer ??= setTimeout(act, Math.max(1 - left, 0) * period);
  };
}

const AGAIN_MS = 2_000;

/** The task done, however often the service must be asked; `lost` is told each time that it does not answer. */
export async function insist(task, lost) {
  for (;;) {
    try {
      return await task();
    } catch {
      lost();
      await new Promise((again) => setTimeout(again, AGAIN_MS));
    }
  }
}
