// Charts along the path: plain SVG that stretches with the page, values and labels as text beside it.

import { clamp } from "./math.js";

const COLUMNS = 600; // of a long line; each keeps its least and its greatest value
const BANDS = 400; // travels shaded at most
const W = 1000;
const H = 100;
const VERDICTS_MOST = 256; // a verdict is a byte
const SVG = ["http:", "", "www.w3.org", "2000", "svg"].join("/"); // a namespace; pages hold no addresses

/** Numbers as one reads them. */
export function figure(v, digits = 1) {
  return Number.isFinite(v) ? v.toFixed(digits).replace("-", "\u2212") : "\u2013";
}

/** An element of a drawing; names reach the page as attributes and texts alone, never as markup. */
function drawn(tag, attributes, children = []) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

const digitsOf = (chart) => (chart.unit === "1" ? 3 : 1);
const unitOf = (chart) => ({ 1: "", deg: "°" })[chart.unit] ?? ` ${chart.unit}`;

export class Charts {
  /** Build all charts of a path into an element; scrubbing one calls onScrub(x). */
  constructor(root, path, verdict, onScrub) {
    this.path = path;
    this.verdict = verdict;
    this.low = path.x[0];
    this.width = Math.max(path.x[path.x.length - 1] - this.low, 1e-9);
    this.all = [];
    let group = null;
    for (const chart of path.charts) {
      for (const line of chart.lines) line.y ??= this._angle(line.angle);
      if (!group || group.name !== chart.group) group = this._group(root, chart.group);
      this.all.push(this._chart(group.box, chart, onScrub));
    }
  }

  /** One of the angles at every sample, deg. */
  _angle(k) {
    const { q, x } = this.path;
    const n = q.length / x.length;
    return Float64Array.from(x, (_, i) => (q[i * n + k] * 180) / Math.PI);
  }

  _group(root, name) {
    const heading = document.createElement("h2");
    heading.textContent = name;
    const box = document.createElement("div");
    box.className = "group";
    root.append(heading, box);
    return { name, box };
  }

  _chart(box, chart, onScrub) {
    const figureElement = document.createElement("figure");
    figureElement.className = chart.small ? "chart small" : "chart";
    const caption = document.createElement("figcaption");
    const title = document.createElement("span");
    title.className = "title";
    title.textContent = `${chart.title}${chart.unit === "1" ? "" : `, ${chart.unit}`}`;
    const now = document.createElement("span");
    now.className = "value";
    caption.append(title, now);
    const plot = document.createElement("div");
    plot.className = "plot";
    plot.append(this._svg(chart));
    const cursor = document.createElement("div");
    cursor.className = "cursor";
    plot.append(cursor);
    figureElement.append(caption, plot, this._below(chart));
    this._labels(plot, chart);
    this._scrub(plot, onScrub);
    box.append(figureElement);
    return { chart, now, cursor, keys: [...figureElement.querySelectorAll(".key b")] };
  }

  x(v) {
    return ((v - this.low) / this.width) * W;
  }

  y(chart, v) {
    const [low, high] = chart.range;
    return H * (1 - clamp((v - low) / (high - low), -0.02, 1.02));
  }

  _svg(chart) {
    const label = `${chart.title}${chart.unit === "1" ? "" : ` in ${chart.unit}`} over ${this.path.timed ? "time" : "targets"}`;
    const lines = chart.lines.map((line, k) => (this.path.timed ? this._line(chart, line, k) : this._dots(chart, line)));
    const parts = [this._bands(), this._gridLines(chart), this._limits(chart), ...lines].flat();
    const frame = { viewBox: `0 0 ${W} ${H}`, preserveAspectRatio: "none", role: "img", "aria-label": label };
    return drawn("svg", frame, parts);
  }

  _gridLines(chart) {
    const d = ticks(chart.range, chart.unit).map((v) => `M0 ${this.y(chart, v).toFixed(2)}H${W}`);
    return [drawn("path", { class: "gridline", d: d.join("") })];
  }

  /** Travels: where the arc is off. */
  _bands() {
    const { x, arc, timed } = this.path;
    if (!timed) return [];
    const d = [];
    for (let i = 0; i < arc.length; i++) {
      if (arc[i]) continue;
      let j = i;
      while (j < arc.length - 1 && !arc[j]) j++;
      d.push(`M${this.x(x[Math.max(i - 1, 0)]).toFixed(2)} 0H${this.x(x[j]).toFixed(2)}V${H}H${this.x(x[Math.max(i - 1, 0)]).toFixed(2)}Z`);
      i = j;
    }
    return d.length && d.length <= BANDS ? [drawn("path", { class: "travel", d: d.join("") })] : [];
  }

  _limits(chart) {
    return chart.limits.flatMap((limit, k) => {
      const y = this.y(chart, limit.y).toFixed(2);
      const below = limit.low || (chart.limits.length === 2 && k === 0);
      const area = limit.good ? [] : [drawn("path", { class: "beyond", d: `M0 ${y}H${W}V${below ? H : 0}H0Z` })];
      return [...area, drawn("path", { class: `limit${limit.good ? " good" : ""}`, d: `M0 ${y}H${W}` })];
    });
  }

  _line(chart, line, k) {
    const points = thinned(this.path.x, line.y).map(([x, y]) =>
      y === null ? null : `${this.x(x).toFixed(1)} ${this.y(chart, y).toFixed(2)}`);
    let pen = "M";
    const d = [];
    for (const point of points) {
      if (point === null) pen = "M";
      else {
        d.push(pen + point);
        pen = "L";
      }
    }
    const colour = `stroke: var(--line-${chart.lines.length > 1 ? k : 0})`;
    return [drawn("path", { class: "line", style: colour, d: d.join("") })];
  }

  /** Without a motion: a dot a target in its verdict's colour; of many one a place on the screen. */
  _dots(chart, line) {
    const byVerdict = new Map();
    const taken = line.y.length > 2 * COLUMNS ? new Set() : null;
    for (let i = 0; i < line.y.length; i++) {
      if (!Number.isFinite(line.y[i])) continue;
      const v = this.verdict[this.path.target[i]];
      if (taken) {
        const column = Math.round((COLUMNS * this.x(this.path.x[i])) / W);
        const place = (column * (H + 1) + Math.round(this.y(chart, line.y[i]))) * VERDICTS_MOST + v;
        if (taken.has(place)) continue;
        taken.add(place);
      }
      if (!byVerdict.has(v)) byVerdict.set(v, []);
      byVerdict.get(v).push(`M${this.x(this.path.x[i]).toFixed(1)} ${this.y(chart, line.y[i]).toFixed(2)}h0`);
    }
    return [...byVerdict].map(([v, d]) =>
      drawn("path", { class: "spots", style: `stroke: var(--verdict-${v})`, d: d.join("") }));
  }

  _labels(plot, chart) {
    for (const v of ticks(chart.range, chart.unit)) {
      const label = document.createElement("span");
      label.className = "tick-y";
      label.style.top = `${this.y(chart, v)}%`;
      label.textContent = figure(v, Number.isInteger(v) ? 0 : 2).replace(/\.?0+$/, (m) => (m.includes(".") ? "" : m));
      plot.append(label);
    }
    const ends = this.path.timed ? [`${figure(this.low, 0)} s`, `${figure(this.low + this.width, 0)} s`]
      : [`target ${this.low}`, `${Math.round(this.low + this.width)}`];
    ends.forEach((text, k) => {
      const label = document.createElement("span");
      label.className = k ? "tick-x end" : "tick-x";
      label.textContent = text;
      plot.append(label);
    });
  }

  /** Limits in words, keys of the lines, a note. */
  _below(chart) {
    const below = document.createElement("p");
    below.className = "below";
    if (chart.lines.length > 1) {
      chart.lines.forEach((line, k) => {
        const key = document.createElement("span");
        key.className = "key";
        key.style.setProperty("--c", `var(--line-${k})`);
        const name = document.createElement("span");
        name.textContent = line.name;
        key.append(document.createElement("i"), name, " ", document.createElement("b"));
        below.append(key);
      });
    }
    const words = chart.limits.map((l) => l.label.replace("-", "\u2212"));
    const text = document.createElement("span");
    text.textContent = [words.length === 2 ? `limits ${words.join(" to ")}` : words[0], chart.note].filter(Boolean).join("; ");
    below.append(text);
    return below;
  }

  _scrub(plot, onScrub) {
    const at = (e) => {
      const box = plot.getBoundingClientRect();
      onScrub(this.low + clamp((e.clientX - box.left) / box.width, 0, 1) * this.width);
    };
    // a mouse only has to pass over; a finger has to touch
    plot.addEventListener("pointermove", at);
    plot.addEventListener("pointerdown", at);
  }

  /** Put every cursor to a sample: x is where, i which. */
  show(x, i) {
    const left = `${(this.x(x) / W) * 100}%`;
    for (const { chart, now, cursor, keys } of this.all) {
      cursor.style.left = left;
      const values = chart.lines.map((line) => figure(line.y[i], digitsOf(chart)));
      if (keys.length) keys.forEach((key, k) => (key.textContent = values[k]));
      else now.textContent = `${values[0]}${values[0] === "\u2013" ? "" : unitOf(chart)}`;
    }
  }
}

/** Values for a few lines across. */
export function ticks([low, high], unit) {
  const rough = (high - low) / 3.2;
  const power = 10 ** Math.floor(Math.log10(rough));
  const angles = unit === "deg" && rough > 10 ? [15, 30, 45, 90, 180, 360] : null;
  const step = (angles || [1, 2, 5, 10].map((k) => k * power)).find((s) => s >= 0.75 * rough) ?? 10 * power;
  const out = [];
  for (let v = Math.ceil(low / step - 1e-9) * step; v <= high + 1e-9; v += step) out.push(Math.abs(v) < 1e-9 ? 0 : +v.toFixed(9));
  return out;
}

/** A line with its peaks kept, [x, y] each; y is null in a gap. */
function thinned(x, y) {
  const value = (i) => (Number.isFinite(y[i]) ? y[i] : null);
  if (x.length <= 2 * COLUMNS) return Array.from(x, (v, i) => [v, value(i)]);
  const out = [];
  for (let c = 0; c < COLUMNS; c++) {
    const [from, to] = [Math.floor((c * x.length) / COLUMNS), Math.floor(((c + 1) * x.length) / COLUMNS)];
    let [least, most, gap] = [-1, -1, false];
    for (let i = from; i < to; i++) {
      if (value(i) === null) gap = true;
      else {
        if (least < 0 || y[i] < y[least]) least = i;
        if (most < 0 || y[i] > y[most]) most = i;
      }
    }
    if (gap) out.push([x[from], null]);
    if (least >= 0) out.push(...[least, most].sort((a, b) => a - b).map((i) => [x[i], y[i]]));
  }
  return out;
}
