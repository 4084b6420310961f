/** Runs modules of the repository's tests/support in Python, for float64 references. */
import { execFile } from "node:child_process";
import { existsSync } from "node:fs";
import { join } from "node:path";

const REPOSITORY = new URL("../../../", import.meta.url).pathname;
const PYTHON = process.env.STEREOCELL_PYTHON ?? join(REPOSITORY, ".venv/bin/python");

export const hasPython = existsSync(PYTHON);

/** Returns the output of a module of tests/support that reads `input`. */
export function askPython(
  module: string,
  given: readonly string[],
  input: string,
): Promise<string> {
  const env = { ...process.env, PYTHONPATH: join(REPOSITORY, "tests") };
  return new Promise((resolve, reject) => {
    const words = ["-m", `support.${module}`, ...given];
    const child = execFile(PYTHON, words, { env }, (error, stdout, stderr) =>
      error ? reject(new Error(stderr)) : resolve(stdout),
    );
    child.stdin?.end(input);
  });
}
