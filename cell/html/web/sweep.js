// The page of a sweep: a map, the pose chosen on it, and the table of all.

import { decode } from "./data.js";
import { SweepMap } from "./sweep_map.js";
import { PoseList } from "./pose_list.js";

/** An element of the page, which has it. @returns {any} */
const find = (id) => document.getElementById(id);
const NAMES = { roll: "Roll", positioner: "Positioner", height_mm: "Height" };
const PLACE = ["positioner_x_mm", "positioner_y_mm", "positioner_z_mm", "positioner_rz_deg"];
const angleText = (v) => `${Number(v.toFixed(3))}`;

function element(tag, content, className) {
  const made = document.createElement(tag);
  if (className) made.className = className;
  made.append(...[content].flat().filter((v) => v != null));
  return made;
}

/** What a pose's cell was given, by axis. */
function cellOf(row) {
  const cell = {};
  if ("roll" in row) cell.roll = row.roll;
  if (PLACE[0] in row) {
    const [x, y, z, rz] = PLACE.map((key) => row[key]);
    cell.positioner = `${x}, ${y}, ${z} mm, ${rz}°`;
  }
  if ("height_mm" in row) cell.height_mm = `${row.height_mm} mm`;
  return cell;
}

class Page {
  constructor(doc) {
    this.doc = doc;
    this.cells = new Map(); // poses by what their cell was given
    doc.poses.forEach((row, i) => {
      const key = JSON.stringify(cellOf(row));
      if (!this.cells.has(key)) this.cells.set(key, []);
      this.cells.get(key).push(i);
    });
    this.map = new SweepMap(find("map"), doc, (i) => this.choose(i));
    this.table = new PoseList(doc, (i) => this.choose(i));
    this._selectors();
    find("colour").addEventListener("change", () => {
      this.map.recolour(find("colour").value);
      this._legend();
    });
    const best = doc.poses.findIndex((r) => r.rank === 1);
    this.choose(Math.max(best, 0));
    this._legend();
    this._marks();
  }

  _selectors() {
    const cells = [...this.cells.keys()].map((key) => JSON.parse(key));
    this.selects = {};
    for (const axis of Object.keys(cells[0])) {
      const select = document.createElement("select");
      for (const value of new Set(cells.map((c) => c[axis]))) select.append(element("option", value));
      select.id = `axis-${axis}`;
      select.addEventListener("change", () => this._showCell());
      this.selects[axis] = select;
      const label = element("label", `${NAMES[axis]} `, "pick");
      label.append(select);
      find("axes").append(label);
    }
  }

  /** Show the cell of the selectors, at the table pose chosen before. */
  _showCell() {
    const wanted = Object.fromEntries(Object.entries(this.selects).map(([axis, s]) => [axis, s.value]));
    const indices = this.cells.get(JSON.stringify(wanted));
    if (!indices) return;
    const before = this.doc.poses[this.chosen];
    const same = indices.find((i) => this.doc.poses[i].E1_deg === before.E1_deg && this.doc.poses[i].E2_deg === before.E2_deg);
    this.choose(same ?? indices[0]);
  }

  choose(i) {
    this.chosen = i;
    const cell = cellOf(this.doc.poses[i]);
    for (const [axis, select] of Object.entries(this.selects)) select.value = cell[axis];
    this.map.show(this.cells.get(JSON.stringify(cell)));
    this.map.choose(i);
    this.table.mark(i);
    this._describe(this.doc.poses[i]);
  }

  _describe(row) {
    const good = row.verdict === "feasible";
    const title = element("h2", [`E1 = ${angleText(row.E1_deg)}°, E2 = ${angleText(row.E2_deg)}° `, element("span", row.verdict, `mark ${row.verdict}`)]);
    const parts = [title];
    const words = Object.entries(cellOf(row)).map(([axis, value]) => `${NAMES[axis].toLowerCase()} ${value}`).join(", ");
    if (words) parts.push(element("p", words, "soft"));
    parts.push(good ? this._measures(row) : this._reasons(row), ...this._how(row));
    find("pose").replaceChildren(...parts);
  }

  _reasons(row) {
    const list = document.createElement("ul");
    for (const [reason, words] of Object.entries(this.doc.reasons)) {
      const k = row.reasons[reason];
      if (!k) continue;
      const dot = element("i", null, "dot");
      dot.style.setProperty("--c", `var(--${reason})`);
      list.append(element("li", [dot, `${k} ${words}`]));
    }
    const all = row.looked_at ?? row.infeasible, open = row.not_looked_at ?? 0;
    const note = row.searched
      ? `${row.infeasible} of ${open ? "the " : ""}${all} targets ${open ? "checked " : ""}cannot be welded here${open ? `; ${open} were not checked` : ""}.`
      : `Settled without a search for a motion: ${row.infeasible} of the ${all} targets checked cannot be welded here, each by itself.`;
    return element("div", [list, element("p", note, "soft")]);
  }

  _measures(row) {
    const list = element("dl", null, "facts");
    const add = (name, value) => value != null && list.append(element("div", [element("dt", name), element("dd", value)]));
    add("rank", `${row.rank} of ${this.doc.poses.filter((r) => r.rank).length}`);
    add("least clearance", row.least_clearance_mm == null ? "more than 50 mm" : `${row.least_clearance_mm.toFixed(1)} mm`);
    if (row.least_margin_share != null) add("singularity margin", `${row.least_margin_share.toFixed(1)} times the limit (${row.least_margin.kind})`);
    if (row.least_joint_room_deg != null) add("room to joint limits", `${row.least_joint_room_deg.toFixed(1)}° (${row.least_joint})`);
    add("off upright at most", `${row.gravity_max_deg.toFixed(0)}°`);
    if (row.time_s != null) add("motion", `${row.time_s.toFixed(0)} s`);
    return list;
  }

  /** How to check the pose: a command line, and where the cell differs a case file for it. */
  _how(row) {
    const { doc } = this;
    const moved = PLACE[0] in row || "height_mm" in row;
    if (!moved) {
      const command = `${doc.command} --e1 ${angleText(row.E1_deg)} --e2 ${angleText(row.E2_deg)} --roll ${row.roll ?? doc.roll}`;
      return [element("p", "To see why, and in 3D with --html:", "soft"), this._copied(command, "command")];
    }
    const lines = [`extends: ${JSON.stringify(doc.extends)}`, `table: {E1_deg: ${angleText(row.E1_deg)}, E2_deg: ${angleText(row.E2_deg)}}`];
    if (PLACE[0] in row) {
      const [x, y, z, rz] = PLACE.map((key) => row[key]);
      const [rx, ry] = doc.rotation_deg;
      lines.push(`positioner: {position_mm: [${x}, ${y}, ${z}], rotation_deg: [${rx}, ${ry}, ${rz}]}`);
    }
    if ("height_mm" in row) {
      const [x, y] = doc.part_mm;
      lines.push(doc.support ? `support: {height_mm: ${row.height_mm}}` : `part: {position_mm: [${x}, ${y}, ${row.height_mm}]}`);
    }
    return [
      element("p", "To see why, save this as pose.case.yaml beside the case:", "soft"),
      this._copied(lines.join("\n"), "case-file"),
      this._copied(`rbam check pose.case.yaml --roll ${row.roll ?? doc.roll}`, "command"),
    ];
  }

  _copied(content, id) {
    const pre = element("pre", content);
    pre.id = id;
    const button = element("button", "Copy");
    button.type = "button";
    button.addEventListener("click", async () => {
      try {
        await navigator.clipboard.writeText(content);
        button.textContent = "Copied";
      } catch {
        getSelection().selectAllChildren(pre); // where copying is not allowed, a key does the rest
        button.textContent = "Selected";
      }
      setTimeout(() => (button.textContent = "Copy"), 1500);
    });
    return element("div", [pre, button], "how");
  }

  _legend() {
    const root = find("legend");
    const range = this.map.range();
    if (this.map.colour !== "verdict") {
      const [low, high] = range || ["", ""];
      root.replaceChildren(...(range ? [element("span", low.toFixed(1)), element("i", null, "gradient"), element("span", high.toFixed(1))] : []),
        element("span", range ? "of the feasible poses" : "no feasible pose"));
      return;
    }
    const present = new Set(this.doc.poses.filter((r) => r.infeasible).flatMap((r) => Object.keys(r.reasons).filter((k) => r.reasons[k])));
    const names = [["feasible", "feasible"], ...Object.entries(this.doc.reasons).filter(([k]) => present.has(k))];
    root.replaceChildren(...names.map(([name, words]) => {
      const swatch = element("i", null, name === "feasible" ? "swatch framed" : "swatch");
      swatch.style.setProperty("--c", `var(--${name})`);
      return element("span", [swatch, name === "feasible" ? words : name.replace("_", " ")]);
    }));
  }

  _marks() {
    const marks = this.doc.marks.map((mark, k) =>
      element("span", [element("b", String.fromCharCode(65 + k)), `${mark.label} (E1 = ${mark.E1_deg}°, E2 = ${mark.E2_deg}°)`]));
    if (this.doc.poses.some((r) => r.rank === 1)) marks.unshift(element("span", [element("b", "★"), "the best"]));
    find("marks").replaceChildren(...marks);
  }
}

function trouble(words) {
  find("trouble").hidden = false;
  find("trouble").textContent = words;
}

try {
  Object.assign(window, { rbam: new Page(await decode(find("data").textContent)) });
  document.documentElement.dataset.ready = String(Math.max(1, Math.round(performance.now())));
} catch (error) {
  trouble(`This page cannot be shown here: ${error.message}`);
  throw error;
}
