/** Writes objects as CSV. Pure. */
import type { ObjectTable } from "./table";

type Known = Pick<ObjectTable, "columns" | "label" | "title" | "exact">;

/** Quotes a field by RFC 4180. A text that a spreadsheet would run as a formula gets an apostrophe in front. */
function field(text: string): string {
  const safe = /^[=+\-@\t\r]/.test(text) && Number.isNaN(Number(text)) ? `'${text}` : text;
  return /[",\r\n]/.test(safe) ? `"${safe.replaceAll('"', '""')}"` : safe;
}

/**
 * Returns CSV with a line for each of `rows`, in the given order. Null: a column is still loading; this call
 * requests all columns that are missing.
 */
export function objectsCsv(table: Known, rows: readonly number[]): string | null {
  const columns = table.columns.map((column) => ({ ...column, values: table.exact(column.id) }));
  const head = ["label", "name", ...columns.map(({ id, unit }) => (unit ? `${id} (${unit})` : id))];
  const lines = [head.map(field).join(",")];
  for (const { values } of columns) if (values === null) return null;
  for (const row of rows) {
    const title = table.title(row);
    const cells = columns.map(({ kind, categories = [], values }) => {
      const value = values?.[row] ?? Number.NaN;
      if (kind === "category") return categories[value] ?? "";
      return Number.isFinite(value) ? String(Number(value.toPrecision(7))) : "";
    });
    lines.push(
      [table.label(row), title === table.label(row) ? "" : title, ...cells].map(field).join(","),
    );
  }
  return `${lines.join("\r\n")}\r\n`;
}
