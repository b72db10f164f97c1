// Tables that readers sort by a column.

/** Value of a cell: its first number, or else its text. */
function value(row: HTMLTableRowElement, column: number): number | string {
  const text = row.cells[column]?.textContent?.trim() ?? "";
  const found = /^-?\d+(\.\d+)?/.exec(text);
  return found ? Number(found[0]) : text;
}

/** Compares numbers before texts. */
function compared(a: number | string, b: number | string): number {
  if (typeof a === "number" && typeof b === "number") return a - b;
  if (typeof a === typeof b) return String(a).localeCompare(String(b));
  return typeof a === "number" ? -1 : 1;
}

/** Turns the heads of a table's columns into buttons that sort its rows, at first in ascending order. */
export function makeSortable(table: HTMLTableElement): void {
  const body = table.tBodies[0];
  const heads = [...(table.tHead?.rows[0]?.cells ?? [])];
  if (!body) return;
  for (const head of heads.filter((cell) => cell.tagName === "TH")) {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = head.textContent;
    button.addEventListener("click", () => {
      const isDescending = head.ariaSort === "ascending";
      heads.forEach((other) => (other.ariaSort = null));
      head.ariaSort = isDescending ? "descending" : "ascending";
      const sign = isDescending ? -1 : 1;
      const column = head.cellIndex;
      const rows = [...body.rows].sort((a, b) => sign * compared(value(a, column), value(b, column)));
      body.append(...rows);
    });
    head.replaceChildren(button);
  }
}
