// All poses in a table that sorts by any column.

import { mainReason } from "./sweep_map.js";

const SHOWN = 100; // rows at first
const MORE = 500;

const number = (digits) => (v) => (v == null ? "" : v.toFixed(digits));

function columns(doc) {
  const reasons = Object.keys(doc.reasons);
  const names = { roll: "Roll", positioner_x_mm: "x mm", positioner_y_mm: "y mm", positioner_z_mm: "z mm",
    positioner_rz_deg: "Turn °", height_mm: "Height mm" };
  const plain = (key, name, digits, wide) => ({ key, name, value: (r) => r[key], text: number(digits), wide, number: true });
  const angle = (key, name) => ({ key, name, value: (r) => r[key], text: (v) => `${Number(v.toFixed(3))}`, number: true });
  return [
    plain("rank", "Rank", 0),
    angle("E1_deg", "E1 °"),
    angle("E2_deg", "E2 °"),
    ...doc.axes.map((key) => ({ key, name: names[key], value: (r) => r[key], text: String, number: key !== "roll" })),
    { key: "infeasible", name: "Infeasible", number: true, value: (r) => r.infeasible / Math.max(r.looked_at || r.infeasible, 1),
      text: (v, r) => (r.infeasible ? `${r.infeasible}${r.searched ? "" : "+"} of ${r.looked_at ?? "?"}` : "") },
    { key: "reason", name: "Mostly", value: (r) => (r.infeasible ? mainReason(r, reasons) : ""), text: (v) => v.replace("_", " "), dot: true },
    plain("least_clearance_mm", "Clearance mm", 1, true),
    plain("least_margin_share", "Margin ×", 1, true),
    plain("least_joint_room_deg", "Joint room °", 1, true),
    plain("gravity_max_deg", "Off upright °", 0, true),
    plain("time_s", "Time s", 0, true),
  ];
}

export class PoseTable {
  /** Fill the table; a click on a row calls onChoose(pose). */
  constructor(doc, onChoose) {
    this.doc = doc;
    this.columns = columns(doc);
    this.onChoose = onChoose;
    this.shown = SHOWN;
    this.sort = { column: 0, up: true };
    this.chosen = -1;
    this.element = document.getElementById("table");
    this.only = document.getElementById("feasible-only");
    this.more = document.getElementById("more");
    this.only.addEventListener("change", () => this.fill());
    this.more.addEventListener("click", () => {
      this.shown += MORE;
      this.fill();
    });
    this._head();
    this.fill();
  }

  _head() {
    const row = document.createElement("tr");
    this.columns.forEach((column, k) => {
      const cell = document.createElement("th");
      cell.scope = "col";
      if (column.wide) cell.className = "extra";
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = column.name;
      button.addEventListener("click", () => {
        this.sort = { column: k, up: this.sort.column === k ? !this.sort.up : true };
        this.fill();
      });
      const printed = document.createElement("span");
      printed.className = "printed";
      printed.textContent = column.name;
      printed.setAttribute("aria-hidden", "true");
      cell.append(button, printed);
      row.append(cell);
    });
    this.element.tHead.append(row);
  }

  /** Poses in order; what has no value comes last either way. */
  sorted() {
    const { column, up } = this.sort;
    const value = this.columns[column].value;
    const poses = this.doc.poses.map((_, i) => i).filter((i) => !this.only.checked || this.doc.poses[i].verdict === "feasible");
    return poses.sort((i, j) => {
      const [a, b] = [value(this.doc.poses[i]), value(this.doc.poses[j])];
      if (a == null || b == null) return (a == null) - (b == null) || i - j;
      return (up ? 1 : -1) * (a < b ? -1 : a > b ? 1 : 0) || i - j;
    });
  }

  fill() {
    const all = this.sorted();
    const some = all.slice(0, this.shown);
    this.element.tBodies[0].replaceChildren(...some.map((i) => this._row(i)));
    this.more.hidden = some.length === all.length;
    this.more.textContent = `Show ${Math.min(MORE, all.length - some.length)} more`;
    document.getElementById("count").textContent = some.length < all.length ? `${some.length} of ${all.length} listed` : `${all.length}`;
    [...this.element.tHead.rows[0].cells].forEach((cell, k) => {
      cell.setAttribute("aria-sort", k !== this.sort.column ? "none" : this.sort.up ? "ascending" : "descending");
    });
    this.mark(this.chosen);
  }

  _row(i) {
    const pose = this.doc.poses[i];
    const row = document.createElement("tr");
    row.dataset.pose = i;
    for (const column of this.columns) {
      const cell = document.createElement("td");
      cell.className = [column.wide ? "extra" : "", column.number ? "number" : ""].join(" ").trim();
      const value = column.value(pose);
      if (column.dot && value) {
        const dot = document.createElement("i");
        dot.className = "dot";
        dot.style.setProperty("--c", `var(--${value})`);
        cell.append(dot);
      }
      cell.append(value == null ? "" : column.text(value, pose));
      row.append(cell);
    }
    row.addEventListener("click", () => this.onChoose(i));
    return row;
  }

  mark(i) {
    this.chosen = i;
    for (const row of this.element.tBodies[0].rows) row.classList.toggle("chosen", Number(row.dataset.pose) === i);
    const row = this.element.querySelector(".chosen");
    const box = this.element.parentElement;
    if (!row || box.matches(":hover")) return;
    const top = row.offsetTop - this.element.tHead.offsetHeight;
    if (top < box.scrollTop || row.offsetTop + row.offsetHeight > box.scrollTop + box.clientHeight) box.scrollTop = top;
  }
}
