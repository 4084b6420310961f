/** `stereocell serve`, where the repository has a .venv (`make setup`). */
import { type ChildProcess, spawn } from "node:child_process";

export const STEREOCELL =
  process.env.STEREOCELL_COMMAND ??
  new URL("../../../../.venv/bin/stereocell", import.meta.url).pathname;

/** `stereocell serve` of a build or a source on a free port, and its address. */
export async function serve(
  out: string,
  flags: readonly string[] = [],
): Promise<Readonly<{ address: string; stop: (signal?: NodeJS.Signals) => void }>> {
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
  return { address, stop: (signal = "SIGKILL") => child.kill(signal) };
}
