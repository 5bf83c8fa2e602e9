// The map on a canvas: E2 across, E1 up; a click or the arrow keys choose a pose.

const LEFT = 44;
const BOTTOM = 40;
const TOP = 22;
const LARGEST = 46; // px a cell

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const degrees = (v) => `${Number(v.toFixed(3))}°`;

function parsed(hex) {
  return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
}

function mixed(a, b, f) {
  const [p, q] = [parsed(a), parsed(b)];
  return `rgb(${p.map((v, k) => Math.round(v + f * (q[k] - v))).join(",")})`;
}

/** The reason that most of a pose's infeasible targets have. */
export function mainReason(row, reasons) {
  return reasons.reduce((a, b) => ((row.reasons[b] || 0) > (row.reasons[a] || 0) ? b : a));
}

/** Whether more of a pose's targets may be infeasible than are counted: not all were checked, or by themselves. */
export function isLowerBound(row) {
  return !row.searched || row.not_looked_at > 0;
}

export class SweepMap {
  /** A map on a canvas; onChoose(pose) is called with the number of the pose chosen. */
  constructor(canvas, doc, onChoose) {
    this.canvas = canvas;
    this.doc = doc;
    this.reasons = Object.keys(doc.reasons);
    this.onChoose = onChoose;
    this.colour = "verdict";
    this.chosen = -1;
    canvas.addEventListener("click", (e) => {
      const i = this.poseAt(e.offsetX, e.offsetY);
      if (i >= 0) this.onChoose(i);
    });
    canvas.addEventListener("mousemove", (e) => {
      const i = this.poseAt(e.offsetX, e.offsetY);
      const row = doc.poses[i];
      canvas.title = row ? `E1 = ${degrees(row.E1_deg)}, E2 = ${degrees(row.E2_deg)}: ${row.verdict}` : "";
    });
    canvas.addEventListener("keydown", (e) => this._key(e));
    new ResizeObserver(() => this.draw()).observe(canvas.parentElement);
    for (const query of ["(prefers-color-scheme: dark)", "print"]) {
      matchMedia(query).addEventListener("change", () => this.draw());
    }
  }

  /** Show some of the poses: those of one cell. */
  show(indices) {
    const rows = indices.map((i) => this.doc.poses[i]);
    const sorted = (name) => [...new Set(rows.map((r) => r[name]))].sort((a, b) => a - b);
    this.turns = sorted("E2_deg");
    this.tilts = sorted("E1_deg");
    this.at = new Map(indices.map((i) => [this._key2(this.doc.poses[i].E1_deg, this.doc.poses[i].E2_deg), i]));
    this.draw();
  }

  recolour(by) {
    this.colour = by;
    this.draw();
  }

  choose(i) {
    this.chosen = i;
    this.draw();
  }

  /** Least and greatest of what poses are coloured by, over all cells; null for verdicts. */
  range() {
    if (this.colour === "verdict") return null;
    const values = this.doc.poses.filter((r) => r.verdict === "feasible").map((r) => r[this.colour]).filter((v) => v != null);
    return values.length ? [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))] : null;
  }

  _key2(e1, e2) {
    return `${e1}/${e2}`;
  }

  _key(e) {
    const step = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [1, 0], ArrowDown: [-1, 0] }[e.key];
    const row = this.doc.poses[this.chosen];
    if (!step || !row) return;
    e.preventDefault();
    const tilt = this.tilts[this.tilts.indexOf(row.E1_deg) + step[0]];
    const turn = this.turns[this.turns.indexOf(row.E2_deg) + step[1]];
    const i = this.at.get(this._key2(tilt, turn));
    if (i !== undefined) this.onChoose(i);
  }

  poseAt(x, y) {
    const k = Math.floor((x - LEFT) / this.size);
    const j = Math.floor((y - TOP) / this.size);
    const i = this.at.get(this._key2(this.tilts[this.tilts.length - 1 - j], this.turns[k]));
    return i === undefined ? -1 : i;
  }

  /** Where the middle of a pose is on the canvas, px. */
  middleOf(i) {
    const row = this.doc.poses[i];
    return this._place(row.E1_deg, row.E2_deg);
  }

  _place(e1, e2) {
    const along = (values, v) => {
      for (let k = 0; k < values.length; k++) if (values[k] === v) return k + 0.5;
      for (let k = 0; k + 1 < values.length; k++) {
        if (values[k] < v && v < values[k + 1]) return k + 0.5 + (v - values[k]) / (values[k + 1] - values[k]);
      }
      return null;
    };
    const x = [e2, e2 - 360, e2 + 360].map((v) => along(this.turns, v)).find((v) => v !== null);
    const y = along(this.tilts, e1);
    if (x === undefined || y === null) return null;
    return [LEFT + x * this.size, TOP + (this.tilts.length - y) * this.size];
  }

  _colourOf(row, range) {
    if (this.colour !== "verdict") {
      if (row.verdict !== "feasible") return this.colours.empty;
      const [low, high] = range || [0, 1];
      const value = row[this.colour] ?? high;
      const f = high > low ? (value - low) / (high - low) : 1;
      const { low: a, middle: b, high: c } = this.colours;
      return f < 0.5 ? mixed(a, b, 2 * f) : mixed(b, c, 2 * f - 1);
    }
    if (row.verdict === "feasible") return this.colours.feasible;
    const share = Math.min(row.infeasible / Math.max(row.looked_at || row.infeasible, 1), 1);
    return mixed(this.colours.card, this.colours[mainReason(row, this.reasons)], 0.6 + 0.4 * Math.sqrt(share));
  }

  draw() {
    if (!this.turns) return;
    const width = this.canvas.clientWidth;
    if (!width) return;
    this.size = Math.min((width - LEFT - 4) / this.turns.length, LARGEST);
    const height = TOP + BOTTOM + this.size * this.tilts.length;
    const ratio = devicePixelRatio || 1;
    this.canvas.style.height = `${height}px`;
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    const names = ["feasible", "empty", "low", "middle", "high", "card", "ink", "soft", "accent", ...this.reasons];
    this.colours = Object.fromEntries(names.map((name) => [name, css(`--${name}`)]));
    // #fff as #ffffff
    for (const name of names) this.colours[name] = this.colours[name].replace(/^#(.)(.)(.)$/, "#$1$1$2$2$3$3");
    const g = this.canvas.getContext("2d");
    g.scale(ratio, ratio);
    g.clearRect(0, 0, width, height);
    this._cells(g);
    this._borders(g);
    this._ticks(g, width);
    this._marks(g);
  }

  _cells(g) {
    const range = this.range();
    const gap = this.size > 9 ? 0.5 : 0;
    for (const [, i] of this.at) {
      const [x, y] = this.middleOf(i);
      g.fillStyle = this._colourOf(this.doc.poses[i], range);
      const side = this.size - 2 * gap + (gap ? 0 : 0.4);
      g.fillRect(x - this.size / 2 + gap, y - this.size / 2 + gap, side, side);
    }
  }

  /** Frame the islands, so that they show without colours as well. */
  _borders(g) {
    g.strokeStyle = this.colours.ink;
    g.lineWidth = 1.4;
    g.beginPath();
    const good = (e1, e2) => this.doc.poses[this.at.get(this._key2(e1, e2))]?.verdict === "feasible";
    const h = this.size / 2;
    this.tilts.forEach((e1, j) => this.turns.forEach((e2, k) => {
      if (!good(e1, e2)) return;
      const [x, y] = this._place(e1, e2);
      const edge = (other, ...ends) => {
        if (other) return;
        g.moveTo(x + ends[0] * h, y + ends[1] * h);
        g.lineTo(x + ends[2] * h, y + ends[3] * h);
      };
      edge(good(e1, this.turns[k - 1]), -1, -1, -1, 1);
      edge(good(e1, this.turns[k + 1]), 1, -1, 1, 1);
      edge(good(this.tilts[j + 1], e2), -1, -1, 1, -1);
      edge(good(this.tilts[j - 1], e2), -1, 1, 1, 1);
    }));
    g.stroke();
  }

  _ticks(g, width) {
    g.fillStyle = this.colours.soft;
    g.font = "12px system-ui, sans-serif";
    const bottom = TOP + this.size * this.tilts.length;
    g.textAlign = "center";
    g.textBaseline = "top";
    for (const k of shown(this.turns, 44 / this.size)) g.fillText(degrees(this.turns[k]), LEFT + (k + 0.5) * this.size, bottom + 5);
    g.textAlign = "right";
    g.textBaseline = "middle";
    for (const k of shown(this.tilts, 18 / this.size)) g.fillText(degrees(this.tilts[k]), LEFT - 5, bottom - (k + 0.5) * this.size);
    g.fillStyle = this.colours.ink;
    g.textAlign = "left";
    g.fillText("E1, tilt", 2, 9);
    g.textAlign = "center";
    g.fillText("E2, turn of the table", LEFT + Math.min(this.size * this.turns.length, width - LEFT) / 2, bottom + 31);
  }

  _marks(g) {
    const ring = (at, radius, colour) => {
      for (const [r, c, w] of [[radius + 1.5, this.colours.card, 4], [radius, colour, 2]]) {
        g.beginPath();
        g.arc(at[0], at[1], r, 0, 2 * Math.PI);
        g.strokeStyle = c;
        g.lineWidth = w;
        g.stroke();
      }
    };
    this.doc.marks.forEach((mark, k) => {
      const at = this._place(mark.E1_deg, mark.E2_deg);
      if (!at) return;
      ring(at, 8, this.colours.ink);
      g.fillStyle = this.colours.card;
      g.fillRect(at[0] + 12, at[1] - 8, 15, 16);
      g.strokeStyle = this.colours.ink;
      g.lineWidth = 1;
      g.strokeRect(at[0] + 12, at[1] - 8, 15, 16);
      g.fillStyle = this.colours.ink;
      g.textAlign = "center";
      g.textBaseline = "middle";
      g.fillText(String.fromCharCode(65 + k), at[0] + 19.5, at[1] + 0.5);
    });
    const best = [...this.at.values()].find((i) => this.doc.poses[i].rank === 1);
    if (best !== undefined) star(g, this.middleOf(best), 6, this.colours.ink);
    if (this.chosen >= 0 && [...this.at.values()].includes(this.chosen)) {
      const [x, y] = this.middleOf(this.chosen);
      const h = this.size / 2 + 1;
      for (const [c, w] of [[this.colours.card, 5], [this.colours.accent, 2.5]]) {
        g.strokeStyle = c;
        g.lineWidth = w;
        g.strokeRect(x - h, y - h, 2 * h, 2 * h);
      }
    }
  }
}

function star(g, centre, radius, ink) {
  const [x, y] = centre;
  for (const [r, colour] of [[radius + 2, ink], [radius, "#ffec78"]]) {
    g.beginPath();
    for (let i = 0; i < 10; i++) {
      const s = i % 2 ? 0.45 * r : r;
      g.lineTo(x + s * Math.sin((Math.PI * i) / 5), y - s * Math.cos((Math.PI * i) / 5));
    }
    g.closePath();
    g.fillStyle = colour;
    g.fill();
  }
}

/** Which values get a label: round ones where they fit. */
function shown(values, apart) {
  for (const step of [15, 30, 45, 90, 180]) {
    const some = values.map((_, k) => k).filter((k) => Math.abs(values[k] % step) < 1e-9);
    if (some.length > 1 && some.slice(1).every((k, n) => k - some[n] >= apart)) return some;
  }
  const every = Math.max(1, Math.ceil(apart));
  return values.map((_, k) => k).filter((k) => k % every === 0);
}
