/**
 * Tables of figures that a test has measured, for readers. A test writes one if an environment
 * variable names a file.
 */
import { writeFile } from "node:fs/promises";

/** Writes a table in Markdown into the file that the environment variable names, if any. */
export async function writeTable(
  variable: string,
  head: readonly string[],
  rows: readonly (readonly string[])[],
): Promise<void> {
  const file = process.env[variable];
  if (file === undefined) return;
  const lines = [head, head.map(() => "---"), ...rows].map((cells) => `| ${cells.join(" | ")} |`);
  await writeFile(file, `${lines.join("\n")}\n`);
}
