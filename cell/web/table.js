// The table of infeasible targets: sorted by any column, filtered by reason, a jump in every row.

import { figure } from "./charts.js";

const SHOWN = 100; // rows at first
const MORE = 500;

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
      title: "Whether every configuration the arm could have was looked at" },
  ];
}

export class Table {
  /** Fill the table; a click on a row calls onJump(target). */
  constructor(doc, targets, onJump) {
    this.rows = doc.infeasible;
    this.columns = columns(doc, targets);
    this.verdictOf = (r) => targets.verdict[r.target];
    this.onJump = onJump;
    this.only = null;
    this.shown = SHOWN;
    this.sort = { column: 3, up: true };
    this.element = document.getElementById("table");
    this.more = document.getElementById("more");
    this.more.addEventListener("click", () => {
      this.shown += MORE;
      this._fill();
    });
    this._head();
    this._fill();
  }

  _head() {
    const row = document.createElement("tr");
    this.columns.forEach((column, k) => {
      const cell = document.createElement("th");
      cell.scope = "col";
      if (column.wide || column.less) cell.className = column.wide ? "extra" : "less";
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = column.name;
      if (column.title) button.title = column.title;
      button.addEventListener("click", () => this._sortBy(k));
      // printers repeat a head's text on every page, but not its buttons
      const printed = document.createElement("span");
      printed.className = "printed";
      printed.textContent = column.name;
      printed.setAttribute("aria-hidden", "true");
      cell.append(button, printed);
      row.append(cell);
    });
    this.element.tHead.append(row);
  }

  _sortBy(column) {
    this.sort = { column, up: this.sort.column === column ? !this.sort.up : true };
    this._fill();
  }

  /** Show one reason's rows (its number among the verdicts), or all with null. */
  filter(verdict) {
    this.only = verdict;
    this.shown = SHOWN;
    this._fill();
  }

  _sorted() {
    const { column, up } = this.sort;
    const by = this.columns[column].order || this.columns[column].value;
    const rows = this.rows.filter((r) => this.only === null || this.verdictOf(r) === this.only);
    const compare = (a, b) => (a < b ? -1 : a > b ? 1 : 0);
    return rows.sort((a, b) => (up ? 1 : -1) * compare(by(a), by(b)) || a.target - b.target);
  }

  _fill() {
    const rows = this._sorted();
    const some = rows.slice(0, this.shown);
    this.element.tBodies[0].replaceChildren(...some.map((r) => this._row(r)));
    this.more.hidden = some.length === rows.length;
    const left = rows.length - some.length;
    this.more.textContent = `Show ${Math.min(MORE, left)} more`;
    document.getElementById("count").textContent = left ? `${some.length} of ${rows.length} listed` : `${rows.length}`;
    [...this.element.tHead.rows[0].cells].forEach((cell, k) => {
      cell.setAttribute("aria-sort", k !== this.sort.column ? "none" : this.sort.up ? "ascending" : "descending");
    });
  }

  _row(r) {
    const row = document.createElement("tr");
    row.dataset.target = r.target;
    for (const column of this.columns) {
      const cell = document.createElement("td");
      cell.className = column.wide ? "extra" : column.less ? "less" : column.wordy ? "wordy" : "";
      if (column.jump) cell.append(this._button(r.target));
      else if (column.dot) {
        const dot = document.createElement("i");
        dot.className = "dot";
        dot.style.setProperty("--c", `var(--verdict-${this.verdictOf(r)})`);
        cell.append(dot, text(column.value(r)));
      } else cell.textContent = column.value(r);
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
    for (const row of this.element.tBodies[0].rows) {
      row.classList.toggle("chosen", Number(row.dataset.target) === target);
    }
    this._scrollTo(this.element.querySelector(".chosen"));
  }

  /** Bring a row into the table's own window, and leave the page where it is. */
  _scrollTo(row) {
    const box = this.element.parentElement;
    if (!row || box.matches(":hover")) return;
    const top = row.offsetTop - this.element.tHead.offsetHeight;
    if (top < box.scrollTop) box.scrollTop = top;
    else if (row.offsetTop + row.offsetHeight > box.scrollTop + box.clientHeight) {
      box.scrollTop = row.offsetTop + row.offsetHeight - box.clientHeight;
    }
  }
}
