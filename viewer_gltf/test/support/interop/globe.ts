/** CesiumJS in a page: tilesets of a bundle on the equator, seen from the front as in the viewer. */
import type * as CesiumModule from "cesium";
import type { Page } from "playwright-core";
import type { Host } from "../browser/host";

declare global {
  interface Window {
    Cesium: typeof CesiumModule;
    globe?: { widget: CesiumModule.CesiumWidget; tileset?: CesiumModule.Cesium3DTileset };
  }
}

type Vec3 = readonly [number, number, number];

/** Folder that the host must serve under `/cesium/`. */
export const CESIUM = new URL("../../../node_modules/cesium/Build/Cesium/", import.meta.url)
  .pathname;

/**
 * Factor to the size of the specimen, which is a tenth of a millimetre long. Cesium's near clipping
 * plane is at 0.1 m.
 */
const SCALE = 1e5;

const PAGE = `<!doctype html>
<style>body { margin: 0 } #view, .cesium-widget, canvas { width: 100vw; height: 100vh; display: block }</style>
<div id="view" class="stage"></div><script>window.CESIUM_BASE_URL = "/cesium/";</script>
<script src="/cesium/Cesium.js"></script>`;

/** `center`: point that the camera looks at from +z, um, world; `width_um`: width of the view there. */
export type View = Readonly<{ center: Vec3; width_um: number }>;
/** Number of loaded tiles, and Cesium's messages about failed ones. */
export type Report = Readonly<{ loaded: number; failed: readonly string[] }>;

export class Globe {
  private constructor(
    private readonly page: Page,
    /** Errors on the console of the page. */
    readonly errors: readonly string[],
  ) {}

  static async open(page: Page, host: Host): Promise<Globe> {
    const errors: string[] = [];
    page.on("console", (message) => {
      if (message.type() === "error") errors.push(message.text());
    });
    page.on("pageerror", (error) => errors.push(error.message));
    host.overrides.set("/favicon.ico", { status: 200, body: "" });
    host.overrides.set("/cesium.html", { status: 200, body: PAGE });
    await page.goto(`${host.address}/cesium.html`);
    await page.evaluate(() => {
      const { Cesium } = window;
      const widget = new Cesium.CesiumWidget("view", {
        baseLayer: false,
        globe: false,
        skyBox: false,
        skyAtmosphere: false,
        creditContainer: document.createElement("div"), // otherwise it would cover the view
      });
      widget.scene.backgroundColor = Cesium.Color.fromBytes(11, 13, 18); // as in the viewer
      window.globe = { widget };
    });
    return new Globe(page, errors);
  }

  /**
   * Draws a tileset in place of the one before, and waits until the view is complete.
   *
   * @param error_px Cesium's maximumScreenSpaceError; a large one keeps surfaces coarse
   */
  draw(address: string, view: View, error_px: number): Promise<Report> {
    return this.page.evaluate(
      async ({ address, view, error_px, SCALE }) => {
        const { Cesium, globe } = window;
        if (globe === undefined) throw new Error("no globe");
        const { scene } = globe.widget;
        scene.primitives.removeAll();
        const place = Cesium.Transforms.eastNorthUpToFixedFrame(
          Cesium.Cartesian3.fromDegrees(0, 0),
        );
        const tileset = await Cesium.Cesium3DTileset.fromUrl(address, {
          modelMatrix: Cesium.Matrix4.multiplyByUniformScale(place, SCALE, new Cesium.Matrix4()),
          maximumScreenSpaceError: error_px,
          environmentMapOptions: { enabled: false },
        });
        globe.tileset = tileset;

        // tileset.json is in metres and z-up: the world's (x, y, z) is its (x, -z, y).
        const at = (x: number, y: number, z: number) =>
          Cesium.Matrix4.multiplyByPoint(
            tileset.modelMatrix,
            new Cesium.Cartesian3(x * 1e-6, -z * 1e-6, y * 1e-6),
            new Cesium.Cartesian3(),
          );
        const [x, y, z] = view.center;
        // the angle of the width
        const { fov } = scene.camera.frustum as CesiumModule.PerspectiveFrustum;
        if (fov === undefined) throw new Error("no field of view");
        const eye = at(x, y, z + view.width_um / 2 / Math.tan(fov / 2));
        const between = (a: CesiumModule.Cartesian3, b: CesiumModule.Cartesian3) => {
          const step = Cesium.Cartesian3.subtract(b, a, new Cesium.Cartesian3());
          return Cesium.Cartesian3.normalize(step, step);
        };
        const direction = between(eye, at(x, y, z));
        const up = between(at(x, y, z), at(x, y + 1, z));
        scene.camera.setView({ destination: eye, orientation: { direction, up } });
        scene.light = new Cesium.DirectionalLight({ direction });

        const failed: string[] = [];
        let loaded = 0;
        tileset.tileFailed.addEventListener(({ url, message }) =>
          failed.push(`${url}: ${message}`),
        );
        tileset.tileLoad.addEventListener(() => {
          loaded++;
        });
        const isDone = new Promise((resolve) => {
          tileset.initialTilesLoaded.addEventListener(resolve);
        });
        scene.primitives.add(tileset);
        await isDone;
        return { loaded, failed };
      },
      { address, view, error_px, SCALE },
    );
  }

  /** Colours objects by a condition on a property, in Cesium's styling language. The others are white. */
  async style(property: string, condition: string, color: string): Promise<void> {
    await this.page.evaluate(
      async ([condition, color]) => {
        const { Cesium, globe } = window;
        if (globe?.tileset === undefined) throw new Error("no tileset");
        const conditions = [
          [condition, `color("${color}")`],
          ["true", 'color("white")'],
        ];
        globe.tileset.style = new Cesium.Cesium3DTileStyle({ color: { conditions } });
        const isDrawn = () => new Promise(requestAnimationFrame);
        for (let frame = 0; frame < 5; frame++) await isDrawn();
      },
      [`\${${property}} ${condition}`, color] as const,
    );
  }

  /** Returns the properties of the object at a pixel; null: none. */
  pick(x: number, y: number): Promise<Readonly<Record<string, unknown>> | null> {
    return this.page.evaluate(
      ([x, y]) => {
        const { Cesium, globe } = window;
        const found: CesiumModule.Cesium3DTileFeature | undefined = globe?.widget.scene.pick(
          new Cesium.Cartesian2(x, y),
        );
        if (found === undefined) return null;
        const ids = found.getPropertyIds();
        return Object.fromEntries(ids.map((id) => [id, found.getProperty(id)]));
      },
      [x, y] as const,
    );
  }

  /** Returns the pixel of a point (um, world). */
  pixelOf(point: Vec3): Promise<{ x: number; y: number }> {
    return this.page.evaluate(([x, y, z]) => {
      const { Cesium, globe } = window;
      if (globe?.tileset === undefined) throw new Error("no tileset");
      const world = Cesium.Matrix4.multiplyByPoint(
        globe.tileset.modelMatrix,
        new Cesium.Cartesian3(x * 1e-6, -z * 1e-6, y * 1e-6),
        new Cesium.Cartesian3(),
      );
      const found = Cesium.SceneTransforms.worldToWindowCoordinates(globe.widget.scene, world);
      if (found === undefined) throw new Error("the point is out of sight");
      return { x: found.x, y: found.y };
    }, point);
  }
}
