/** The viewer as what the benchmark measures. */
import { Vector3 } from "three";
import type { BenchMode, Device } from "../bench/report";
import type { Subject } from "../bench/runs";
import { XR_DISTANCE_M } from "../render/placement";
import { setTo } from "../state/parameters/kinds";
import { DWELL, QUALITY } from "../state/parameters/tools";
import { MODE, type Mode, SWITCH_DISTANCE } from "../state/parameters/volumes";
import { volumeChannels } from "../state/viewer_state";
import { ahead } from "../xr/head_pose";
import type { Viewer } from "./viewer";

const MODES: Record<BenchMode, Mode> = { mesh: "off", disc: "disc", all: "all", traced: "traced" };
/** The disc is open from wherever the specimen is flown. */
const ALWAYS_NEAR_M = 10;

export function subjectOf(viewer: Viewer): Subject {
  const { renderer, contents, bundle } = viewer;
  const { tiles, channels } = bundle.manifest;
  return {
    device: deviceOf(renderer.getContext() as WebGL2RenderingContext),
    tiles: tiles.length,
    channels: channels.length,
    canTrace: viewer.state.canTrace,
    edges: async () => {
      const [first] = volumeChannels(viewer.state);
      const sources = first && (await contents.volumes.sourcesOf(first.id));
      // of the tile with most voxels: those at a specimen's end have fewer
      const sizes = [...(sources?.values() ?? [])].map(({ volume }) =>
        volume.levels.map(({ size }) => Math.max(...size)),
      );
      const [largest = []] = sizes.sort((a, b) => b[0] - a[0]);
      return [...new Set(largest)].sort((a, b) => a - b);
    },
    limit: (edge) => viewer.limitEdge(edge),
    show: (mode) => {
      // a head at rest would choose a tile, and whole frames are compared
      viewer.dispatch(setTo(DWELL, false));
      viewer.dispatch(setTo(QUALITY, "high"));
      viewer.dispatch(setTo(MODE, MODES[mode]));
      viewer.dispatch(setTo(SWITCH_DISTANCE, ALWAYS_NEAR_M));
    },
    settled: () => viewer.settled(),
    stand: () => {
      const { head } = viewer;
      const eye = new Vector3().setFromMatrixPosition(head).toArray();
      const isFlat = viewer.stereo.kind === null;
      return { eye, middle: isFlat ? [0, 0, 0] : ahead(head, XR_DISTANCE_M).toArray() };
    },
    fly: (specimen) => viewer.lookFrom({ ...viewer.navigation.lookNow, specimen }),
    nextFrame: () => viewer.nextFrame(),
    cost: () => {
      const { drawCalls, triangles, volumeBytes } = viewer.snapshot();
      return { drawCalls, triangles, volumeBytes };
    },
    settings: () => viewer.snapshot().settings,
    endStereo: async () => {
      if (viewer.stereo.kind === null) return;
      viewer.stereo.end();
      await viewer.nextFrame();
    },
  };
}

function deviceOf(gl: WebGL2RenderingContext): Device {
  const info = gl.getExtension("WEBGL_debug_renderer_info");
  const name: unknown = gl.getParameter(info?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER);
  return {
    renderer: String(name),
    browser: navigator.userAgent,
    cores: navigator.hardwareConcurrency,
    picture_px: [gl.drawingBufferWidth, gl.drawingBufferHeight],
  };
}
