/** Runs `stereocell serve`, if the repository has a .venv (`make setup`). */
import { type ChildProcess, spawn } from "node:child_process";

export const STEREOCELL =
  process.env.STEREOCELL_COMMAND ??
  new URL("../../../../.venv/bin/stereocell", import.meta.url).pathname;

/** Serves a build or a source on a free port. Returns the address, and a function that stops the server. */
export async function serve(
  out: string,
  flags: readonly string[] = [],
): Promise<Readonly<{ address: string; stop: (signal?: NodeJS.Signals) => Promise<void> }>> {
  const child: ChildProcess = spawn(STEREOCELL, ["serve", out, "--port", "0", ...flags]);
  const address = await new Promise<string>((resolve, reject) => {
    let output = "";
    const collect = (data: Buffer) => {
      output += data.toString();
      const [found] = /http:\/\/localhost:\d+\//.exec(output) ?? [];
      if (found !== undefined) resolve(found);
    };
    child.stdout?.on("data", collect);
    child.stderr?.on("data", collect);
    child.on("exit", (code) => reject(new Error(`serve ended with ${code}: ${output}`)));
  });
  const ended = new Promise<void>((resolve) => child.on("exit", () => resolve()));
  const stop = (signal: NodeJS.Signals = "SIGKILL") => {
    child.kill(signal);
    return ended;
  };
  return { address, stop };
}
