// All poses in a table that sorts by any column.

import { Sortable, swatch } from "./sortable.js";
import { isLowerBound, mainReason } from "./sweep_map.js";

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
      text: (v, r) => (r.infeasible ? `${r.infeasible}${isLowerBound(r) ? "+" : ""} of ${r.looked_at ?? "?"}` : "") },
    { key: "reason", name: "Mostly", value: (r) => (r.infeasible ? mainReason(r, reasons) : ""), text: (v) => v.replace("_", " "), dot: true },
    plain("least_clearance_mm", "Clearance mm", 1, true),
    plain("least_margin_share", "Margin ×", 1, true),
    plain("least_joint_room_deg", "Joint room °", 1, true),
    plain("gravity_max_deg", "Off upright °", 0, true),
    plain("time_s", "Time s", 0, true),
  ];
}

export class PoseList {
  /** Fill the table; a click on a row calls onChoose(pose). */
  constructor(doc, onChoose) {
    this.doc = doc;
    this.onChoose = onChoose;
    this.chosen = -1;
    this.only = /** @type {HTMLInputElement} */ (document.getElementById("feasible-only"));
    this.only.addEventListener("change", () => this.fill());
    this.table = new Sortable(columns(doc), 0, () => this.fill());
    this.fill();
  }

  /** Poses in order; what has no value comes last either way. */
  sorted() {
    const { column, up } = this.table.sort;
    const value = this.table.columns[column].value;
    const poses = this.doc.poses.map((_, i) => i).filter((i) => !this.only.checked || this.doc.poses[i].verdict === "feasible");
    return poses.sort((i, j) => {
      const [a, b] = [value(this.doc.poses[i]), value(this.doc.poses[j])];
      if (a == null || b == null) return Number(a == null) - Number(b == null) || i - j;
      return (up ? 1 : -1) * (a < b ? -1 : a > b ? 1 : 0) || i - j;
    });
  }

  fill() {
    this.table.fill(this.sorted(), (i) => this._row(i));
    this.mark(this.chosen);
  }

  _row(i) {
    const pose = this.doc.poses[i];
    const row = document.createElement("tr");
    row.dataset.pose = i;
    for (const column of this.table.columns) {
      const cell = document.createElement("td");
      cell.className = [column.wide ? "extra" : "", column.number ? "number" : ""].join(" ").trim();
      const value = column.value(pose);
      if (column.dot && value) cell.append(swatch(value));
      cell.append(value == null ? "" : column.text(value, pose));
      row.append(cell);
    }
    row.addEventListener("click", () => this.onChoose(i));
    return row;
  }

  mark(i) {
    this.chosen = i;
    this.table.mark((row) => Number(row.dataset.pose) === i);
  }
}
