/**
 * Time every renderer in headless Chromium, in rounds: node run.ts JOB OUT.
 *
 * JOB is a JSON file, see `Job`. A run's picture goes to OUT/NAME.rgba (bottom row first), its
 * times to OUT/timings.json. Each scene has a browser of its own, and each run a page that stays
 * open while the scene is measured. One page draws at a time.
 */
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { type BrowserContext, chromium, type Page } from "playwright-core";
import { build } from "vite";
import { drawingProcess_s } from "../../../viewer_gltf/test/support/browser/cpu_time";

type Run = Readonly<{
  name: string;
  renderer: string;
  scene: string;
  camera: string;
  setting: number;
}>;
type Job = Readonly<{ rounds: number; runs: readonly Run[] }>;
/** Milliseconds of a frame by the clock, and of CPU time of the drawing process, for each round. */
type Timing = { name: string; ms: number[]; cpu_ms: number[]; steps: number | null };

const HERE = new URL(".", import.meta.url).pathname;
/** The measured viewer; it may be that of another checkout. */
const VIEWER = process.env.STEREOCELL_VIEWER || join(HERE, "../../../viewer_gltf");
const ORIGIN = "http://bench.localhost/";
const SOFTWARE = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"];
const FLAGS = [
  "--headless=new",
  "--no-sandbox",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
  "--ignore-gpu-blocklist",
  "--disable-gpu-watchdog", // it ends a GPU process that draws one frame for ten seconds
];
/** CPU time of a round. The system counts in hundredths of a second, so this is exact to 2 %. */
const ROUND_S = 0.5;
const MAX_FRAMES = 20;

async function bundled(renderer: string): Promise<string> {
  const built = await build({
    configFile: false,
    logLevel: "error",
    root: HERE,
    define: { "process.env.NODE_ENV": '"production"', global: "globalThis" },
    resolve: {
      alias: { viewer: join(VIEWER, "src") },
      dedupe: ["three"], // otherwise the viewer's sources load a second copy
    },
    build: {
      write: false,
      target: "es2022",
      modulePreload: false,
      lib: { entry: join(HERE, `src/${renderer}.ts`), formats: ["iife"], name: "renderer" },
    },
  });
  for (const { output } of [built].flat() as { output: { type: string; code?: string }[] }[]) {
    const code = output.find(({ type }) => type === "chunk")?.code;
    if (code !== undefined) return code;
  }
  throw new Error(`nothing was built of ${renderer}`);
}

async function open(context: BrowserContext, run: Run): Promise<Page> {
  const page = await context.newPage();
  const said: string[] = [];
  page.on("pageerror", (error) => said.push(String(error)));
  await page.goto(`${ORIGIN}${run.renderer}.html`);
  try {
    await page.evaluate(
      ({ scene, camera, setting }) => window.bench?.setup(scene, camera, setting),
      run,
    );
  } catch (error) {
    throw new Error(`${run.name}: ${[error, ...said].join("\n")}`);
  }
  return page;
}

async function measure(
  context: BrowserContext,
  rounds: number,
  runs: readonly Run[],
  out: string,
): Promise<Timing[]> {
  const session = await context.browser()?.newBrowserCDPSession();
  if (session === undefined) throw new Error("the context has no browser");
  const opened: [Page, number, Timing][] = [];
  for (const run of runs) {
    const page = await open(context, run);
    const before_s = await drawingProcess_s(session);
    const text = await page.evaluate(() => window.bench?.picture() ?? "");
    const frame_s = (await drawingProcess_s(session)) - before_s;
    await writeFile(join(out, `${run.name}.rgba`), Buffer.from(text, "base64"));
    const steps = await page.evaluate(() => window.bench?.countSteps() ?? null);
    const frames = Math.min(MAX_FRAMES, Math.max(1, Math.ceil(ROUND_S / Math.max(frame_s, 0.01))));
    opened.push([page, frames, { name: run.name, ms: [], cpu_ms: [], steps }]);
  }
  for (let round = 0; round < rounds; round++) {
    for (const [page, frames, { ms, cpu_ms }] of opened) {
      const before_s = await drawingProcess_s(session);
      ms.push(await page.evaluate((count) => window.bench?.time(count) ?? Number.NaN, frames));
      cpu_ms.push((1000 * ((await drawingProcess_s(session)) - before_s)) / frames);
    }
  }
  return opened.map(([, , timing]) => timing);
}

async function main([jobFile, out]: readonly string[]): Promise<void> {
  const job = JSON.parse(await readFile(jobFile, "utf8")) as Job;
  const scripts = new Map<string, string>();
  for (const { renderer } of job.runs) {
    if (!scripts.has(renderer)) scripts.set(renderer, await bundled(renderer));
  }
  const timings: Timing[] = [];
  for (const scene of new Set(job.runs.map((run) => run.scene))) {
    const runs = job.runs.filter((run) => run.scene === scene);
    timings.push(...(await inBrowser(scripts, out, (page) => measure(page, job.rounds, runs, out))));
  }
  await writeFile(join(out, "timings.json"), JSON.stringify(timings));
}

/** Start a browser whose pages load the renderers and the scenes in `out`, and end it after use. */
async function inBrowser<T>(
  scripts: ReadonlyMap<string, string>,
  out: string,
  use: (context: BrowserContext) => Promise<T>,
): Promise<T> {
  const profile = await mkdtemp(join(tmpdir(), "stereocell-bench-"));
  const context = await chromium.launchPersistentContext(profile, {
    executablePath: process.env.CHROMIUM || "/usr/bin/chromium",
    headless: false, // playwright's own switch starts the old headless mode
    args: [...FLAGS, ...(process.env.STEREOCELL_GPU_FLAGS?.split(" ") ?? SOFTWARE)],
    viewport: { width: 600, height: 600 },
    deviceScaleFactor: 1,
  });
  try {
    await context.route(`${ORIGIN}**`, async (route) => {
      const name = new URL(route.request().url()).pathname.slice(1);
      if (name.endsWith(".html")) {
        const script = name.replace(".html", ".js");
        const body = `<!doctype html><body style="margin:0"><script src="${script}"></script></body>`;
        return route.fulfill({ contentType: "text/html; charset=utf-8", body });
      }
      const script = scripts.get(name.replace(".js", ""));
      if (script !== undefined) {
        return route.fulfill({ contentType: "text/javascript; charset=utf-8", body: script });
      }
      if (/^\w+\.(json|bin)$/.test(name)) return route.fulfill({ path: join(out, name) });
      return route.fulfill({ status: 404 });
    });
    return await use(context);
  } finally {
    await context.close();
    await rm(profile, { recursive: true, force: true });
  }
}

await main(process.argv.slice(2));
