/** `stereocell serve`, where the repository has a .venv (`make setup`). */
import { type ChildProcess, spawn } from "node:child_process";

export const STEREOCELL =
  process.env.STEREOCELL_COMMAND ??
  new URL("../../../../.venv/bin/stereocell", import.meta.url).pathname;

/** `stereocell serve` of a build or a source on a free port, and its address; `stop` waits for its end. */
export async function serve(
  out: string,
  flags: readonly string[] = [],
): Promise<Readonly<{ address: string; stop: (signal?: NodeJS.Signals) => Promise<void> }>> {
  const child: ChildProcess = spawn(STEREOCELL, ["serve", out, "--port", "0", ...flags]);
  const address = await new Promise<string>((resolve, reject) => {
    let said = "";
    const hear = (data: Buffer) => {
      said += data.toString();
      const [found] = /http:\/\/localhost:\d+\//.exec(said) ?? [];
      if (found !== undefined) resolve(found);
    };
    child.stdout?.on("data", hear);
    child.stderr?.on("data", hear);
    child.on("exit", (code) => reject(new Error(`serve ended with ${code}: ${said}`)));
  });
  const ended = new Promise<void>((resolve) => child.on("exit", () => resolve()));
  const stop = (signal: NodeJS.Signals = "SIGKILL") => {
    child.kill(signal);
    return ended;
  };
  return { address, stop };
}
