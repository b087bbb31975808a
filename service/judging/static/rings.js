// The rings of an outline while it is drawn: the first is the exterior, holes follow. No page is known here.

export const LEAST = 3;

export class Rings {
  /** Rings of [x, y]; one that is not closed yet is still being drawn, and is the last. */
  constructor(rings = []) {
    this.rings = rings.map((points) => ({ points, closed: true }));
    if (!this.rings.length) this.rings.push({ points: [], closed: false });
    this.chosen = null; // the vertex that was touched last: ring and index
  }

  get open() {
    return this.rings.find((ring) => !ring.closed);
  }

  /** A vertex more of the ring that is being drawn. */
  append(point) {
    const ring = this.open;
    if (!ring) return;
    ring.points.push(point);
    this.chosen = { ring, index: ring.points.length - 1 };
  }

  insert({ ring, index }, point) {
    ring.points.splice(index, 0, point);
    this.chosen = { ring, index };
  }

  move({ ring, index }, point) {
    ring.points[index] = point;
  }

  close() {
    const ring = this.open;
    if (ring && ring.points.length >= LEAST) ring.closed = true;
  }

  begin() {
    if (!this.open) this.rings.push({ points: [], closed: false });
  }

  /** Take a vertex away; a ring with too few left goes on being drawn, or goes. */
  take({ ring, index }) {
    ring.points.splice(index, 1);
    this.chosen = null;
    if (ring.closed && ring.points.length < LEAST) this.drop(ring);
  }

  /** Take a ring away: with the exterior all holes. */
  drop(ring) {
    this.chosen = null;
    const at = this.rings.indexOf(ring);
    this.rings = at > 0 ? this.rings.filter((one) => one !== ring) : [{ points: [], closed: false }];
  }

  /** The vertex nearest to a point, within reach; null where there is none. */
  vertexAt([x, y], reach) {
    let best = null;
    for (const ring of this.rings) {
      ring.points.forEach(([px, py], index) => {
        const apart = Math.hypot(px - x, py - y);
        if (apart <= (best ? best.apart : reach)) best = { ring, index, apart };
      });
    }
    return best;
  }

  /** Where a vertex on the edge nearest to a point would go, within reach; null where there is none. */
  edgeAt(point, reach) {
    let best = null;
    for (const ring of this.rings) {
      const { points, closed } = ring;
      for (let k = closed ? 0 : 1; k < points.length; k += 1) {
        const apart = fromEdge(point, points[(k || points.length) - 1], points[k]);
        if (apart <= (best ? best.apart : reach)) best = { ring, index: k || points.length, apart };
      }
    }
    return best;
  }
}

function fromEdge([x, y], [ax, ay], [bx, by]) {
  const [right, down] = [bx - ax, by - ay];
  const share = Math.min(Math.max(((x - ax) * right + (y - ay) * down) / (right ** 2 + down ** 2 || 1), 0), 1);
  return Math.hypot(x - ax - share * right, y - ay - share * down);
}
