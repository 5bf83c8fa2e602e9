// What the tables share that sort by any column: their head, how many rows are shown, and the row that is chosen.

const SHOWN = 100; // rows at first
const MORE = 500;

export class Sortable {
  /** Build the head; whenever the order or the number of rows changes, onChange() is to fill the rows anew. */
  constructor(columns, column, onChange) {
    this.columns = columns;
    this.sort = { column, up: true };
    this.onChange = onChange;
    this.shown = SHOWN;
    this.element = /** @type {HTMLTableElement} */ (document.getElementById("table"));
    this.more = document.getElementById("more");
    this.more.addEventListener("click", () => {
      this.shown += MORE;
      onChange();
    });
    const row = document.createElement("tr");
    row.append(...columns.map((each, k) => this._cell(each, k)));
    this.element.tHead.append(row);
  }

  _cell(column, k) {
    const cell = document.createElement("th");
    cell.scope = "col";
    if (column.wide || column.less) cell.className = column.wide ? "extra" : "less";
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = column.name;
    if (column.title) button.title = column.title;
    button.addEventListener("click", () => {
      this.sort = { column: k, up: this.sort.column === k ? !this.sort.up : true };
      this.onChange();
    });
    // printers repeat a head's text on every page, but not its buttons
    const printed = document.createElement("span");
    printed.className = "printed";
    printed.textContent = column.name;
    printed.setAttribute("aria-hidden", "true");
    cell.append(button, printed);
    return cell;
  }

  /** Show the first of the items that are to be listed, with rowOf(item) for each. */
  fill(items, rowOf) {
    const some = items.slice(0, this.shown);
    const left = items.length - some.length;
    this.element.tBodies[0].replaceChildren(...some.map(rowOf));
    this.more.hidden = left === 0;
    this.more.textContent = `Show ${Math.min(MORE, left)} more`;
    document.getElementById("count").textContent = left ? `${some.length} of ${items.length} listed` : `${items.length}`;
    [...this.element.tHead.rows[0].cells].forEach((cell, k) => {
      cell.setAttribute("aria-sort", k !== this.sort.column ? "none" : this.sort.up ? "ascending" : "descending");
    });
  }

  /** Show no more rows than at first. */
  shorten() {
    this.shown = SHOWN;
  }

  /** Mark the row for which chosen(row) is true, and bring it into the table's own window; the page stays where it is. */
  mark(chosen) {
    for (const row of this.element.tBodies[0].rows) row.classList.toggle("chosen", chosen(row));
    const row = /** @type {HTMLElement | null} */ (this.element.querySelector(".chosen"));
    const box = this.element.parentElement;
    if (!row || box.matches(":hover")) return;
    const top = row.offsetTop - this.element.tHead.offsetHeight;
    if (top < box.scrollTop) box.scrollTop = top;
    else if (row.offsetTop + row.offsetHeight > box.scrollTop + box.clientHeight) {
      box.scrollTop = row.offsetTop + row.offsetHeight - box.clientHeight;
    }
  }
}

/** A dot in a colour of the page's. */
export function swatch(colour) {
  const mark = document.createElement("i");
  mark.className = "dot";
  mark.style.setProperty("--c", `var(--${colour})`);
  return mark;
}
