/** Makes images larger than the screen, and videos. The page's own frames wait meanwhile. */
import type { Matrix4, Object3D, WebGLRenderer } from "three";
import type { Manifest } from "../bundle/generated/bundle";
import { element } from "../dom/element";
import { type Still, type StillMaker, TRACED_SAMPLES } from "../host/still";
import type { Navigation } from "../interaction/orbit_camera";
import { axesOf } from "../marks/axes";
import { umPerPixelAt } from "../marks/um_per_pixel";
import type { KeptView } from "../state/kept_views";
import { isTraced } from "../state/parameters/volumes";
import type { ViewerState } from "../state/viewer_state";
import { pathThrough, turntable } from "./camera_path";
import { type Caption, drawCaption } from "./caption";
import { type FilmedFile, FRAMES_PER_S, frameWriter, pngOf } from "./encode_video";
import { labelBoxes } from "./label_boxes";
import { legendOf } from "./legend";

/** Largest number of pixels of an image. Browsers refuse larger canvases, and phones have lower limits. */
const MAX_PIXELS = 120e6;
/** Longest time to draw one part of an image, ms, without and with path tracing; after that it is used as it is. */
const PART_MS = 8000;
const TRACED_PART_MS = 60_000;
/** Longest time of drawing before the page may do other work, ms. */
const SLICE_MS = 500;
const FRAME_MS = 400;
const TRACED_FRAME_MS = 1500;
/** Longest wait of a frame of a video for finer surfaces and volumes, ms. */
const ARRIVAL_MS = 5000;
/** Length of a video: of a full turn, and from one saved view to the next, s. */
const ROUND_S = 6;
const LEG_S = 2;
/** Longest edge of a video, pixels. */
const LONGEST_FRAME_PX = 1920;

export type Scene = Readonly<{
  renderer: WebGLRenderer;
  navigation: Navigation;
  studio: StillMaker;
  /** Height of the canvas on the page, CSS pixels. */
  height_px: number;
  /** From um to the scene. */
  specimen: Matrix4;
  /** Contains the labels of the scene. */
  labelled: Object3D;
  state: ViewerState;
  manifest: Manifest;
  /** Returns the meaning of the colours of a label map's objects. */
  colorsOf: Parameters<typeof legendOf>[2];
}>;

/** Returns the caption for the present camera. */
function captionOf({ navigation, height_px, specimen, state, manifest, colorsOf }: Scene): Caption {
  const { camera, controls } = navigation;
  const m_per_um = specimen.getMaxScaleOnAxis();
  return {
    um_per_px: umPerPixelAt(controls.target, camera, height_px, m_per_um),
    legend: legendOf(state, manifest, colorsOf),
    axes: axesOf(manifest.specimen.sides),
    head: camera.matrixWorld,
    specimen,
    isLight: document.documentElement.dataset.theme === "light",
    labels: [], // in a video labels move, and the caption must not jump from corner to corner to avoid them
  };
}

/** Returns the caption for the present camera, with parts that avoid the labels in the image. */
function clearCaptionOf(scene: Scene): Caption {
  const { navigation, labelled, height_px } = scene;
  const { camera } = navigation;
  const size = { width: height_px * camera.aspect, height: height_px };
  return { ...captionOf(scene), labels: labelBoxes(labelled, camera, size) };
}

/** Lets the page do waiting work. A timer is not used, since timers of a hidden page run only once a second. */
function turn(): Promise<void> {
  const { port1, port2 } = new MessageChannel();
  return new Promise((resolve) => {
    port1.onmessage = () => {
      port1.close();
      resolve();
    };
    port2.postMessage(null);
  });
}

function canvasOf(width: number, height: number) {
  const canvas = element("canvas", { width, height });
  const context = canvas.getContext("2d");
  if (context === null) throw new DOMException("there is no canvas of this size", "EncodingError");
  return { canvas, context };
}

/**
 * Makes an image of the view, larger than the screen by the factor `wanted` if that is possible. It is drawn part by
 * part on the screen's own canvas, so that it needs no additional memory of the GPU. Scale bar, legend and axes are
 * drawn on it. Path tracing gathers light in each part until it is clear.
 *
 * @param onPart called with a text about the progress
 * @returns the image; null if it was cancelled
 */
export function savePicture(
  scene: Scene,
  wanted: number,
  onPart: (words: string) => void,
  signal: AbortSignal,
): Promise<Blob | null> {
  const { renderer, studio, navigation } = scene;
  const { camera } = navigation;
  const { width, height } = renderer.domElement;
  const isTwo = scene.state.screenStereo === "side-by-side"; // its halves can't be drawn in parts
  const most = isTwo ? 1 : Math.floor(Math.sqrt(MAX_PIXELS / (width * height)));
  const scale = Math.max(1, Math.min(wanted, most));
  const eye = isTwo ? width / 2 : width; // width of the camera's view
  return studio.apart(async () => {
    const { canvas, context } = canvasOf(scale * width, scale * height);
    const words = clearCaptionOf(scene); // made before the camera is limited to one part
    try {
      for (let row = 0; row < scale; row++) {
        for (let column = 0; column < scale; column++) {
          const [x, y] = [column * width, row * height];
          camera.setViewOffset(scale * eye, scale * height, x, y, eye, height);
          const part = `part ${row * scale + column + 1} of ${scale * scale}`;
          const isWhole = await drawPart(studio, part, onPart, signal);
          if (!isWhole) return null;
          context.drawImage(renderer.domElement, x, y); // must follow drawing at once: the canvas is cleared later
          await turn();
        }
      }
    } finally {
      camera.clearViewOffset();
    }
    if (!isTwo) drawCaption(context, canvas, scale * renderer.getPixelRatio(), words);
    return pngOf(canvas);
  });
}

/** Makes a small image of the view, drawn within a short time. */
export function posterOf(scene: Scene, longest_px: number): Promise<Blob> {
  const { renderer, studio } = scene;
  const { width, height } = renderer.domElement;
  const shrink = Math.min(1, longest_px / Math.max(width, height));
  return studio.apart(async () => {
    const { canvas, context } = canvasOf(Math.round(shrink * width), Math.round(shrink * height));
    studio.drawStill(FRAME_MS);
    context.imageSmoothingQuality = "high";
    context.drawImage(renderer.domElement, 0, 0, canvas.width, canvas.height);
    drawCaption(context, canvas, shrink * renderer.getPixelRatio(), clearCaptionOf(scene));
    return pngOf(canvas);
  });
}

/** Draws the camera's view until it is clear or the time is over; returns false if it was cancelled. */
async function drawPart(
  studio: StillMaker,
  part: string,
  onPart: (words: string) => void,
  signal: AbortSignal,
): Promise<boolean> {
  const start_ms = performance.now();
  let still: Still | null = null;
  for (;;) {
    still = studio.drawStill(SLICE_MS, still);
    const { samples, isDone } = still;
    onPart(samples === null ? part : `${part}, ${samples} of ${TRACED_SAMPLES} samples of light`);
    const most_ms = samples === null ? PART_MS : TRACED_PART_MS;
    if (isDone || performance.now() - start_ms > most_ms) return true;
    await turn();
    if (signal.aborted) return false;
  }
}

/**
 * Makes a video through the saved views if there are at least two, otherwise once around the specimen. Calls `onSecond`
 * for each second of it, and returns null if it was cancelled.
 */
export function saveVideo(
  scene: Scene,
  views: readonly KeptView[],
  onSecond: (done: number, of: number) => void,
  signal: AbortSignal,
): Promise<FilmedFile | null> {
  const { renderer, studio, navigation, state } = scene;
  const path =
    views.length > 1
      ? pathThrough(views, LEG_S * FRAMES_PER_S * (views.length - 1) + 1)
      : turntable(navigation.cameraPose, ROUND_S * FRAMES_PER_S);
  const { width, height } = renderer.domElement;
  const shrink = Math.min(1, LONGEST_FRAME_PX / Math.max(width, height));
  const even = (edge: number) => Math.max(2, 2 * Math.floor((shrink * edge) / 2));
  return studio.apart(async () => {
    const { canvas, context } = canvasOf(even(width), even(height));
    const writer = await frameWriter(canvas.width, canvas.height);
    for (const [i, view] of path.entries()) {
      if (signal.aborted) {
        writer.close();
        return null;
      }
      navigation.lookFrom(view);
      await studio.arrive(1 / FRAMES_PER_S, ARRIVAL_MS);
      studio.drawStill(isTraced(state) ? TRACED_FRAME_MS : FRAME_MS);
      context.drawImage(renderer.domElement, 0, 0, canvas.width, canvas.height);
      if (state.screenStereo !== "side-by-side") {
        drawCaption(context, canvas, shrink * renderer.getPixelRatio(), captionOf(scene));
      }
      await writer.add(canvas);
      if (i % FRAMES_PER_S === 0) onSecond(i + 1, path.length);
      await turn();
    }
    return writer.finish();
  });
}
