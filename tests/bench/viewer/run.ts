/**
 * Time every renderer in one headless Chromium, in rounds: node run.ts JOB OUT.
 *
 * JOB is a JSON file, see `Job`. A run's picture goes to OUT/NAME.rgba (bottom row first), its
 * times to OUT/timings.json. Each run has a page of its own that stays open; one draws at a time.
 */
import { mkdtemp, readFile, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { type BrowserContext, chromium, type Page } from "playwright-core";
import { build } from "vite";

type Run = Readonly<{
  name: string;
  renderer: string;
  scene: string;
  camera: string;
  setting: number;
}>;
type Job = Readonly<{ rounds: number; runs: readonly Run[] }>;
type Timing = { name: string; ms: number[]; steps: number | null };

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
];

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

async function measure(context: BrowserContext, job: Job, out: string): Promise<Timing[]> {
  const opened: [Run, Page, Timing][] = [];
  for (const run of job.runs) {
    const page = await open(context, run);
    const text = await page.evaluate(() => window.bench?.picture() ?? "");
    await writeFile(join(out, `${run.name}.rgba`), Buffer.from(text, "base64"));
    const steps = await page.evaluate(() => window.bench?.countSteps() ?? null);
    opened.push([run, page, { name: run.name, ms: [], steps }]);
  }
  for (let round = 0; round < job.rounds; round++) {
    for (const [, page, timing] of opened) {
      timing.ms.push(await page.evaluate(() => window.bench?.time() ?? Number.NaN));
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
    const timings = await measure(context, job, out);
    await writeFile(join(out, "timings.json"), JSON.stringify(timings));
  } finally {
    await context.close();
    await rm(profile, { recursive: true, force: true });
  }
}

await main(process.argv.slice(2));
