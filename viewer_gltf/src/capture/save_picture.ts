/** Pictures larger than the screen, and videos: drawn apart from the frames of the page, which wait. */
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

/** Most pixels of a picture: browsers refuse larger canvases, phones at less. */
const MAX_PIXELS = 120e6;
/** Longest time for one part of a picture, and for one frame of a video, ms: then it is as good as it is. */
const PART_MS = 8000;
const TRACED_PART_MS = 60_000;
/** Between two times that the page gets on with what else there is, ms. */
const SLICE_MS = 500;
const FRAME_MS = 400;
const TRACED_FRAME_MS = 1500;
/** Longest wait of a frame of a video for finer surfaces and volumes, ms. */
const ARRIVAL_MS = 5000;
/** Length of a video: once round, and from one kept view to the next, s. */
const ROUND_S = 6;
const LEG_S = 2;
/** Longest edge of a video, pixels. */
const LONGEST_FRAME_PX = 1920;

export type Scene = Readonly<{
  renderer: WebGLRenderer;
  navigation: Navigation;
  studio: StillMaker;
  /** Of the stage, CSS pixels. */
  height_px: number;
  /** From um to the room. */
  specimen: Matrix4;
  /** What has labels in it. */
  labelled: Object3D;
  state: ViewerState;
  manifest: Manifest;
  /** What the colours of a label map's objects mean. */
  colorsOf: Parameters<typeof legendOf>[2];
}>;

/** What is written on it, as the camera stands now. */
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
    labels: [], // in a video they move, and nothing is to hop about for them
  };
}

/** The same, clear of the labels in the picture. */
function clearCaptionOf(scene: Scene): Caption {
  const { navigation, labelled, height_px } = scene;
  const { camera } = navigation;
  const size = { width: height_px * camera.aspect, height: height_px };
  return { ...captionOf(scene), labels: labelBoxes(labelled, camera, size) };
}

/** Let the page do what waits. Not by a timer: those of a page that nobody sees tick once a second. */
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
 * The view, `scale` times as large as the screen has it, part by part: each fills the screen's own canvas,
 * so that no more of the GPU's memory is needed. Scale bar, legend and axes are drawn on it. A traced one is
 * gathered until it is clear.
 *
 * @param onPart told in words how far it is
 * @returns null: it was left
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
  const isTwo = scene.state.screenStereo === "side-by-side"; // whose halves are no parts of one picture
  const most = isTwo ? 1 : Math.floor(Math.sqrt(MAX_PIXELS / (width * height)));
  const scale = Math.max(1, Math.min(wanted, most));
  const eye = isTwo ? width / 2 : width; // of what the camera sees
  return studio.apart(async () => {
    const { canvas, context } = canvasOf(scale * width, scale * height);
    const words = clearCaptionOf(scene); // before the camera sees parts alone
    try {
      for (let row = 0; row < scale; row++) {
        for (let column = 0; column < scale; column++) {
          const [x, y] = [column * width, row * height];
          camera.setViewOffset(scale * eye, scale * height, x, y, eye, height);
          const part = `part ${row * scale + column + 1} of ${scale * scale}`;
          const isWhole = await drawPart(studio, part, onPart, signal);
          if (!isWhole) return null;
          context.drawImage(renderer.domElement, x, y); // in the turn that it was drawn in
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

/** The view as the screen has it, smaller, drawn as well as can be in a moment. */
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

/** Draw what the camera sees until it is clear, or its time is over; false: it was left. */
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

/** Through views, if there are two, else once round; `onSecond` after each second of it. Null: it was left. */
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
