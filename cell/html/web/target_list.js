// The list of infeasible targets: sorted by any column, filtered by reason, a jump in every row.

import { figure } from "./charts.js";
import { Sortable, swatch } from "./sortable.js";

const text = (v) => document.createTextNode(v);

function columns(doc, targets) {
  const reason = (r) => doc.verdicts[targets.verdict[r.target]].replace("_", " ");
  const base = (r) => [0, 1, 2].map((k) => figure(targets.base_mm[3 * r.target + k], 0)).join(", ");
  return [
    { name: "Target", value: (r) => r.target, jump: true },
    { name: "Where", less: true, value: (r) => `${doc.sub_volumes[targets.sub_volume[r.target]]}, layer ${targets.layer[r.target]}`,
      order: (r) => targets.sub_volume[r.target] * 1e5 + targets.layer[r.target] },
    { name: "Reason", value: reason, dot: true },
    { name: "What went wrong", value: (r) => r.words, order: (r) => -r.severity, wordy: true },
    { name: "x, y, z mm (base)", value: base, order: (r) => targets.base_mm[3 * r.target], wide: true },
    { name: "Gravity °", value: (r) => figure(targets.gravity[r.target]), order: (r) => targets.gravity[r.target], wide: true },
    { name: "Proved", value: (r) => (r.proved ? "yes" : ""), wide: true,
      title: "Whether every configuration the arm could have is excluded" },
  ];
}

export class TargetList {
  /** Fill the table; a click on a row calls onJump(target). */
  constructor(doc, targets, onJump) {
    this.rows = doc.infeasible;
    this.verdictOf = (r) => targets.verdict[r.target];
    this.onJump = onJump;
    this.only = null;
    this.table = new Sortable(columns(doc, targets), 3, () => this._fill());
    this._fill();
  }

  /** Show one reason's rows (its number among the verdicts), or all with null. */
  filter(verdict) {
    this.only = verdict;
    this.table.shorten();
    this._fill();
  }

  _sorted() {
    const { column, up } = this.table.sort;
    const { order, value } = this.table.columns[column];
    const by = order || value;
    const rows = this.rows.filter((r) => this.only === null || this.verdictOf(r) === this.only);
    const compare = (a, b) => (a < b ? -1 : a > b ? 1 : 0);
    return rows.sort((a, b) => (up ? 1 : -1) * compare(by(a), by(b)) || a.target - b.target);
  }

  _fill() {
    this.table.fill(this._sorted(), (r) => this._row(r));
  }

  _row(r) {
    const row = document.createElement("tr");
    row.dataset.target = r.target;
    for (const column of this.table.columns) {
      const cell = document.createElement("td");
      cell.className = column.wide ? "extra" : column.less ? "less" : column.wordy ? "wordy" : "";
      if (column.jump) cell.append(this._button(r.target));
      else if (column.dot) cell.append(swatch(`verdict-${this.verdictOf(r)}`), text(column.value(r)));
      else cell.textContent = column.value(r);
      row.append(cell);
    }
    row.addEventListener("click", () => this.onJump(r.target));
    return row;
  }

  _button(target) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "jump";
    button.textContent = target;
    button.setAttribute("aria-label", `Go to target ${target}`);
    return button;
  }

  /** Mark the row of a target. */
  mark(target) {
    this.table.mark((row) => Number(row.dataset.target) === target);
  }
}
