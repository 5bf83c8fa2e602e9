// Colours of beads and targets by verdict, layer or thickness, and their legend.

import { clamp } from "./math.js";
import { figure } from "./charts.js";

// feasible first, then the reasons in the order of cell/html_words.py; report.css has the same as --verdict-N
const VERDICTS = ["#12906e", "#c62828", "#e8710a", "#c2185b", "#7e57c2", "#1976d2", "#00838f", "#8d6e3a", "#4e342e"];
const HANGING = "#0d59f2"; // what overhangs, as in pictures
const OPEN = "#8a939c"; // not checked
const OTHER = "#5d4037"; // of what only motions and programs from outside have wrong
const colour = (k) => VERDICTS[k] ?? OTHER;
const LAYERS = ["#3b1f6b", "#a12d7c", "#e8663d", "#f9d14a"]; // first to last
const THICKNESSES = ["#1d4e89", "#3aa6a0", "#e9d66b"]; // thin to thick

const parsed = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);

function ramp(hexes, f) {
  const at = clamp(f, 0, 1) * (hexes.length - 1);
  const i = Math.min(Math.floor(at), hexes.length - 2);
  const [a, b] = [parsed(hexes[i]), parsed(hexes[i + 1])];
  return a.map((v, k) => v + (at - i) * (b[k] - v));
}

function dotted(hex, words) {
  const item = document.createElement("span");
  const dot = document.createElement("i");
  dot.className = "dot";
  dot.style.setProperty("--c", hex);
  item.append(dot, words);
  return item;
}

export class Paint {
  constructor(doc, targets) {
    this.doc = doc;
    this.targets = targets;
    this.layers = targets.layer.reduce((a, b) => Math.max(a, b), 0);
    this.thin = targets.thickness.reduce((a, b) => Math.min(a, b), Infinity);
    this.thick = targets.thickness.reduce((a, b) => Math.max(a, b), 0);
  }

  /** Colours of beads and of marks: functions of a target. */
  by(mode) {
    const t = this.targets;
    const verdict = (i) => parsed(this._colour(t.verdict[i]));
    const range = Math.max(this.thick - this.thin, 1e-9);
    // neighbouring layers differ in lightness as well
    const layer = (i) => ramp(LAYERS, t.layer[i] / Math.max(this.layers, 1)).map((v) => v * (t.layer[i] % 2 ? 0.82 : 1));
    const thickness = (i) => ramp(THICKNESSES, (t.thickness[i] - this.thin) / range);
    const whole = { verdict, layer, thickness }[mode];
    const bead = (i) => (t.hanging?.[i] ? parsed(HANGING) : whole(i));
    // an infeasible target is to be seen whatever the beads are coloured by
    return [bead, (i) => (t.verdict[i] ? verdict(i) : bead(i).map((v) => 0.5 * v + 0.45))];
  }

  _colour(k) {
    return this.doc.verdicts[k] === "not_looked_at" ? OPEN : colour(k);
  }

  legend(root, mode) {
    root.replaceChildren();
    if (mode === "verdict") {
      const present = new Set(this.targets.verdict);
      this.doc.verdicts.forEach((name, k) => present.has(k) && root.append(dotted(this._colour(k), name.replaceAll("_", " "))));
    } else {
      this.ramped(root, mode);
    }
    if (this.targets.hanging) root.append(dotted(HANGING, "overhanging"));
  }

  ramped(root, mode) {
    const [hexes, from, to] = mode === "layer"
      ? [LAYERS, "layer 0", `${this.layers}`]
      : [THICKNESSES, `${figure(1e3 * this.thin, 2)}`, `${figure(1e3 * this.thick, 2)} mm thick`];
    const bar = document.createElement("i");
    bar.className = "ramp";
    bar.style.background = `linear-gradient(to right, ${hexes.join(", ")})`;
    root.append(from, bar, to);
  }
}
