/**
 * Draws pictures of files with other web programs: three.js and CesiumJS.
 *
 *   npx tsx scripts/draw_models.ts JOBS.json
 *
 * JOBS.json is a list of `Job`. A picture's alpha is the silhouette of the drawn model.
 */
import { readFile, writeFile } from "node:fs/promises";
import { basename, dirname } from "node:path";
import type * as CesiumModule from "cesium";
import { enter, startChromium } from "../test/support/browser/chromium";
import { Host } from "../test/support/browser/host";

/** A camera that looks along -z of a file's axes, y up; `slopes` are half the picture's size at a distance of 1. */
type View = Readonly<{
  eye: readonly [number, number, number];
  slopes: readonly [number, number];
  near: number;
  far: number;
}>;
/** Distant lights by the directions from which they come, and the intensity of the environment usd_assets/studio.exr. */
type Lights = Readonly<{
  suns: readonly Readonly<{
    color: readonly [number, number, number];
    intensity: number;
    towards: readonly [number, number, number];
  }>[];
  dome: number;
}>;
type Job = Readonly<{
  program: "three" | "cesium";
  file: string;
  view: View;
  /** Lights for three.js only; Cesium has its own. */
  lights: Lights;
  pixels: readonly [number, number];
  picture: string;
}>;

const NODE_MODULES = new URL("../node_modules/", import.meta.url).pathname;

/** three.js with the lights of a stage, which a glTF file does not have. */
const THREE_PAGE = `<!doctype html><body style="margin: 0"><script type="importmap">
{"imports": {"three": "/modules/three/build/three.module.js", "three/addons/": "/modules/three/examples/jsm/"}}
</script><script type="module">
import * as THREE from "three";
import { EXRLoader } from "three/addons/loaders/EXRLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { USDLoader } from "three/addons/loaders/USDLoader.js";

const renderer = new THREE.WebGLRenderer({ alpha: true, antialias: true });
document.body.append(renderer.domElement);
const image = await new EXRLoader().loadAsync("/lights/studio.exr");
image.mapping = THREE.EquirectangularReflectionMapping;

window.draw = async (address, view, lights, [width, height]) => {
  const isGltf = /[.]gl(b|tf)$/.test(address);
  const loaded = await (isGltf ? new GLTFLoader() : new USDLoader()).loadAsync(address);
  const scene = new THREE.Scene();
  scene.environment = image;
  scene.environmentIntensity = lights.dome;
  scene.environmentRotation.y = -Math.PI / 2; // USD and three begin an image of all directions elsewhere
  scene.add(isGltf ? loaded.scene : loaded);
  for (const { color, intensity, towards } of lights.suns) {
    const light = new THREE.DirectionalLight(new THREE.Color(...color), intensity);
    light.position.set(...towards);
    scene.add(light);
  }
  const fov = (2 * Math.atan(view.slopes[1]) * 180) / Math.PI;
  const camera = new THREE.PerspectiveCamera(fov, width / height, view.near, view.far);
  camera.position.set(...view.eye);
  renderer.setSize(width, height);
  renderer.render(scene, camera);
  return renderer.domElement.toDataURL("image/png");
};
window.isReady = true;
</script>`;

const CESIUM_PAGE = `<!doctype html>
<style>body { margin: 0 } #view, .cesium-widget, canvas { width: 100vw; height: 100vh; display: block }</style>
<div id="view"></div><script>window.CESIUM_BASE_URL = "/modules/cesium/Build/Cesium/";</script>
<script src="/modules/cesium/Build/Cesium/Cesium.js"></script><script>window.isReady = true;</script>`;

declare global {
  interface Window {
    draw: (
      address: string,
      view: View,
      lights: Lights,
      pixels: readonly [number, number],
    ) => Promise<string>;
    isReady?: boolean;
  }
}

/** Draws a model with Cesium on the equator, scaled so that the near plane of 0.1 m does not cut it. */
async function drawByCesium([address, view]: readonly [string, View]): Promise<string> {
  const { Cesium } = window;
  document.querySelector("#view")?.replaceChildren();
  const widget = new Cesium.CesiumWidget("view", {
    baseLayer: false,
    globe: false,
    skyBox: false,
    skyAtmosphere: false,
    msaaSamples: 1, // with more samples, each partly covered pixel would have full alpha
    creditContainer: document.createElement("div"),
    contextOptions: { webgl: { alpha: true, preserveDrawingBuffer: true } },
  });
  const { scene } = widget;
  scene.backgroundColor = new Cesium.Color(0, 0, 0, 0);
  const scale = 1000 / (view.near + view.far);
  const place = Cesium.Transforms.eastNorthUpToFixedFrame(Cesium.Cartesian3.fromDegrees(0, 0));
  const modelMatrix = Cesium.Matrix4.multiplyByUniformScale(place, scale, new Cesium.Matrix4());
  const model = await Cesium.Model.fromGltfAsync({
    url: address,
    modelMatrix,
    forwardAxis: Cesium.Axis.X, // the file's (x, y, z) thus becomes (x, -z, y) at that place
    incrementallyLoadTextures: false,
  } as Parameters<typeof CesiumModule.Model.fromGltfAsync>[0]);
  const at = ([x, y, z]: readonly [number, number, number]) =>
    Cesium.Matrix4.multiplyByPoint(
      modelMatrix,
      new Cesium.Cartesian3(x, -z, y),
      new Cesium.Cartesian3(),
    );
  const [x, y, z] = view.eye;
  const eye = at(view.eye);
  const towards = (point: readonly [number, number, number]) => {
    const step = Cesium.Cartesian3.subtract(at(point), eye, new Cesium.Cartesian3());
    return Cesium.Cartesian3.normalize(step, step);
  };
  const direction = towards([x, y, z - view.far]);
  const up = towards([x, y + view.far, z]);
  scene.camera.setView({ destination: eye, orientation: { direction, up } });
  scene.light = new Cesium.DirectionalLight({
    direction: towards([x + 0.4 * view.far, y - 0.5 * view.far, z - view.far]),
  });
  const frustum = scene.camera.frustum as CesiumModule.PerspectiveFrustum;
  frustum.fov = 2 * Math.atan(Math.max(...view.slopes));
  scene.primitives.add(model);
  await new Promise<void>((resolve) => {
    if (model.ready) resolve();
    else model.readyEvent.addEventListener(() => resolve());
  });
  for (let frame = 0; frame < 5; frame++) await new Promise(requestAnimationFrame);
  scene.render();
  const picture = scene.canvas.toDataURL("image/png");
  widget.destroy();
  return picture;
}

const [list] = process.argv.slice(2);
if (list === undefined) {
  process.stderr.write("usage: npx tsx scripts/draw_models.ts JOBS.json\n");
  process.exit(2);
}
const jobs: readonly Job[] = JSON.parse(await readFile(list, "utf8"));
const folders = [...new Set(jobs.map(({ file }) => dirname(file)))];
const host = await Host.start({
  "/modules/": NODE_MODULES,
  "/lights/": new URL("../../usd_assets/", import.meta.url).pathname,
  ...Object.fromEntries(folders.map((folder, n) => [`/files/${n}/`, folder])),
});
host.overrides.set("/favicon.ico", { status: 200, body: "" });
host.overrides.set("/three.html", { status: 200, body: THREE_PAGE });
host.overrides.set("/cesium.html", { status: 200, body: CESIUM_PAGE });
const chromium = await startChromium();
try {
  for (const program of ["three", "cesium"] as const) {
    for (const { file, view, lights, pixels, picture } of jobs.filter(
      (job) => job.program === program,
    )) {
      const [width, height] = pixels;
      const browser = await enter(chromium, { viewport: { width, height }, pixelRatio: 1 });
      const page = await browser.context.newPage();
      // Code that tsx compiles names functions by a helper, which the page does not have.
      await page.addInitScript({ content: "globalThis.__name = (named) => named;" });
      const errors: string[] = [];
      page.on("pageerror", (error) => errors.push(error.message));
      page.on("console", (message) => {
        if (message.type() === "error") errors.push(message.text());
      });
      await page.goto(`${host.address}/${program}.html`);
      await page.waitForFunction(() => window.isReady);
      const address = `/files/${folders.indexOf(dirname(file))}/${basename(file)}`;
      const drawn =
        program === "three"
          ? await page.evaluate(
              ([address, view, lights, pixels]) => window.draw(address, view, lights, pixels),
              [address, view, lights, pixels] as const,
            )
          : await page.evaluate(drawByCesium, [address, view] as const);
      if (errors.length > 0) throw new Error(`${program}: ${file}: ${errors.join("; ")}`);
      await writeFile(picture, Buffer.from(drawn.slice(drawn.indexOf(",") + 1), "base64"));
      await browser.close();
    }
  }
} finally {
  await chromium.close();
  await host.stop();
}
