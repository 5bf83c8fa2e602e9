// The page: what is shown is a place x on the path (seconds, or a target's number where there is no motion).

import { decode } from "./data.js";
import { Cell } from "./scene.js";
import { Targets } from "./meshes.js";
import { Viewer } from "./viewer.js";
import { attach } from "./controls.js";
import { Charts, figure } from "./charts.js";
import { TargetList } from "./target_list.js";
import { Paint } from "./paint.js";

/** An element of the page, which has it. @returns {any} */
const find = (id) => document.getElementById(id);
const PLAYED = 30; // s that the whole motion is played in

class Report {
  constructor(doc) {
    this.doc = doc;
    this.path = doc.path;
    this.targets = new Targets(doc.targets);
    this.cell = new Cell(doc.scene);
    this.angles = doc.joints.length;
    this.first = this._firstSamples();
    this.bad = new Map(doc.infeasible.map((r) => [r.target, r]));
    find("drawn").textContent = this.path.note;
    find("unlisted").textContent = doc.unlisted
      ? `The worst of each reason are listed; ${doc.unlisted.toLocaleString("en")} more are in the 3D view, the charts and the document of --json.` : "";
    this.cell.pose(this.anglesAt(this.first[doc.start], 0));
    this.charts = new Charts(find("charts"), this.path, this.targets.verdict, (x) => this.scrub(x));
    if (!doc.feasible) this.table = new TargetList(doc, this.targets, (i) => this.jump(i));
    this.paint = new Paint(doc, this.targets);
    this.viewer = this._viewer();
    this._listen();
    this.x = this.path.x[doc.feasible ? this.path.x.length - 1 : this.first[doc.start]];
    this.show(this.x);
    this.recolour(doc.feasible ? "layer" : "verdict");
  }

  /** The view, or null where the browser cannot draw it. */
  _viewer() {
    try {
      const viewer = new Viewer(find("view"), this.doc, this.cell, this.targets);
      attach(viewer, (i) => this.jump(i, false));
      return viewer;
    } catch (error) {
      trouble(`The 3D view cannot be drawn here (${error.message}); charts and table work without it.`);
      return null;
    }
  }

  /** What is wrong at a target; undefined where nothing is. */
  _wrong(target) {
    const verdict = this.targets.verdict[target];
    if (this.bad.has(target) || !verdict) return this.bad.get(target);
    const found = Number.isFinite(this.path.q[this.first[target] * this.angles]);
    return { words: this.doc.verdict_words[this.doc.verdicts[verdict]], attempt: found, pair: [] };
  }

  /** The first welding sample of every target. */
  _firstSamples() {
    const { target, arc } = this.path;
    const first = new Int32Array(this.targets.count).fill(-1);
    for (let i = 0; i < target.length; i++) if (arc[i] && first[target[i]] < 0) first[target[i]] = i;
    return first.map((v, i) => (v >= 0 ? v : Math.max(target.indexOf(i), 0)));
  }

  _listen() {
    const slider = find("time");
    slider.min = this.path.x[0];
    slider.max = this.path.x[this.path.x.length - 1];
    slider.step = this.path.timed ? "any" : 1;
    slider.addEventListener("input", () => this.scrub(Number(slider.value)));
    find("play").addEventListener("click", () => this.play(!this.playing));
    find("back").addEventListener("click", () => this.step(-1));
    find("on").addEventListener("click", () => this.step(1));
    find("colour").addEventListener("change", () => this.recolour(find("colour").value));
    for (const input of /** @type {NodeListOf<HTMLInputElement>} */ (document.getElementsByName("view"))) {
      input.addEventListener("change", () => this.viewer?.reset(input.value));
    }
    for (const name of ["arm", "targets", "volume"]) {
      const box = find(`show-${name}`);
      box.addEventListener("change", () => {
        if (!this.viewer) return;
        this.viewer.show[name] = box.checked;
        this.viewer.redraw();
      });
    }
    for (const b of /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll(".jump[data-target]"))) {
      b.addEventListener("click", () => this.jump(Number(b.dataset.target), true, "least" in b.dataset));
    }
    document.querySelectorAll(".chip").forEach((b) => b.addEventListener("click", () => this._filter(b)));
    new ResizeObserver(() => this.viewer?.redraw()).observe(find("view"));
    addEventListener("beforeprint", () => this._still());
    addEventListener("afterprint", () => (find("still").hidden = true));
    find("view").addEventListener("webglcontextlost", (e) => e.preventDefault());
    find("view").addEventListener("webglcontextrestored", () => this._restore());
  }

  _restore() {
    this.viewer._build();
    this.recolour(find("colour").value);
  }

  _filter(button) {
    const on = button.getAttribute("aria-pressed") !== "true";
    document.querySelectorAll(".chip").forEach((b) => b.setAttribute("aria-pressed", String(b === button && on)));
    this.table?.filter(on ? this.doc.verdicts.indexOf(button.dataset.reason) : null);
    this.table?.mark(this.viewer?.chosen ?? -1);
  }

  recolour(mode) {
    find("colour").value = mode;
    const [bead, mark] = this.paint.by(mode);
    this.viewer?.recolour(bead, mark);
    this.paint.legend(find("legend"), mode);
  }

  /** The sample at or before x. */
  sampleAt(x) {
    const xs = this.path.x;
    let [low, high] = [0, xs.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (xs[middle] <= x) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  /** Angles between a sample and the next; the arm's home where there is no configuration. */
  anglesAt(i, f) {
    const { q } = this.path;
    const n = this.angles;
    const j = Math.min(i + 1, q.length / n - 1);
    const home = this.doc.scene.home;
    return Array.from({ length: n }, (_, k) => {
      const a = q[i * n + k];
      return Number.isFinite(a) ? a + (f ? f * (q[j * n + k] - a) : 0) : home[k];
    });
  }

  /** Show what is at x, all over the page. */
  show(x) {
    const { path, viewer } = this;
    const i = this.sampleAt(x);
    const next = Math.min(i + 1, path.x.length - 1);
    const f = path.timed && next > i ? Math.min(1, (x - path.x[i]) / Math.max(path.x[next] - path.x[i], 1e-9)) : 0;
    this.x = x;
    this.cell.pose(this.anglesAt(i, f));
    const target = path.target[i];
    const welding = path.timed && Boolean(path.arc[i]);
    const home = path.timed && i > path.arc.lastIndexOf(1);
    if (viewer) {
      viewer.laid = welding || home ? target : target - 1;
      viewer.live = welding && next > i && Boolean(path.arc[next]) && this.targets.joined(target);
      const row = this._wrong(target);
      const red = path.timed ? this.red || [] : row?.pair || [];
      viewer.red = new Set(red.flatMap((name) => this.doc.scene.culprits[name] || []));
      viewer.chosen = path.timed ? -1 : target;
      viewer.redraw();
    }
    find("time").value = x;
    this.charts.show(x, i);
    this.table?.mark(target);
    find("now").textContent = this._words(x, i, target, home ? "on the way home from" : welding ? "welding" : "on the way to");
  }

  _words(x, i, target, doing) {
    const { path, targets, doc } = this;
    const where = `${doc.sub_volumes[targets.sub_volume[target]]}, layer ${targets.layer[target]}`;
    if (!path.timed) {
      const row = this._wrong(target);
      const arm = row && !row.attempt ? " (no configuration: the arm is at home)" : row ? " (the arm at its best attempt)" : "";
      return `Target ${target}, ${where}: ${row ? row.words : "feasible"}${arm}`;
    }
    const pair = path.pair[i] >= 0 ? `; nearest: ${path.pairs[path.pair[i]].join(" and ")}` : "";
    const line = path.line && path.file[i] >= 0 ? `; ${path.files[path.file[i]]}:${path.line[i]}` : "";
    return `${figure(x, 1)} s, ${doing} ${where}, target ${target}${line}${pair}`;
  }

  scrub(x) {
    this.play(false);
    this.red = null;
    this.show(this.path.timed ? x : Math.round(x));
  }

  step(by) {
    const i = this.sampleAt(this.x);
    // between two beads the last target reached is the one before
    const between = !this.path.arc[i];
    const to = this.path.target[i] + (between && by > 0 ? 0 : by);
    this.jump(Math.min(Math.max(to, 0), this.targets.count - 1), false);
  }

  /** Go to a target; `centre` brings it into the middle, `least` to the nearest place of its way and shows the pair. */
  jump(target, centre = true, least = false) {
    this.play(false);
    this.red = least ? this.doc.least : null;
    this.show(this.path.x[least ? this._nearest(target) : this.first[target]]);
    if (centre) this.viewer?.centreOn(target);
  }

  /** The sample of least clearance on the way from or to a target. */
  _nearest(target) {
    const chart = this.path.charts.find((c) => c.pairs);
    let best = -1;
    this.path.target.forEach((t, i) => {
      if (t === target && (best < 0 || chart.lines[0].y[i] < chart.lines[0].y[best])) best = i;
    });
    return Math.max(best, 0);
  }

  play(on) {
    if (this.playing === on) return;
    this.playing = on;
    find("play").textContent = on ? "Pause" : "Play";
    find("play").setAttribute("aria-label", on ? "Pause" : "Play");
    if (!on) return;
    const { x } = this.path;
    const [start, end] = [x[0], x[x.length - 1]];
    if (this.x >= end - 1e-6) this.x = start;
    this.red = null;
    let before = performance.now();
    let at = this.x;
    const tick = (now) => {
      if (!this.playing) return;
      at = Math.min(end, at + ((now - before) / 1000) * ((end - start) / PLAYED));
      before = now;
      this.show(this.path.timed ? at : Math.floor(at));
      if (at >= end) this.play(false);
      else requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  /** What the view shows as an image: printers get no canvas. */
  _still() {
    if (!this.viewer) return;
    const still = find("still");
    still.src = this.viewer.still(1900, 1000);
    still.hidden = false;
  }
}

function trouble(text) {
  find("trouble").textContent = text;
  find("trouble").hidden = false;
}

try {
  // for the console and for tests
  Object.assign(window, { rbam: new Report(await decode(find("data").textContent)) });
  document.documentElement.dataset.ready = String(Math.round(performance.now()));
} catch (error) {
  trouble(`This report could not be opened: ${error.message}. A current browser is needed.`);
  throw error;
}
