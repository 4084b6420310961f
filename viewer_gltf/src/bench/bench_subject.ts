/** Adapts the viewer to the interface that the benchmark measures. */
import { Vector3 } from "three";
import type { PartHost } from "../host/part";
import { XR_DISTANCE_M } from "../render/placement";
import { setTo } from "../state/parameters/kinds";
import { DWELL, QUALITY } from "../state/parameters/tools";
import { MODE, type Mode, SWITCH_DISTANCE } from "../state/parameters/volumes";
import { volumeChannels } from "../state/viewer_state";
import { ahead } from "../xr/head_pose";
import type { BenchMode, Device } from "./report";
import type { Subject } from "./runs";

const MODES: Record<BenchMode, Mode> = { mesh: "off", disc: "disc", all: "all", traced: "traced" };
/** Volume distance, m, at which the disc shows during the whole flight. */
const ALWAYS_NEAR_M = 10;

export function subjectOf(host: PartHost): Subject {
  const { bundle, display, viewpoint, stereo } = host;
  const { tiles, channels } = bundle.manifest;
  return {
    device: deviceOf(host.canvas.getContext("webgl2") as WebGL2RenderingContext),
    tiles: tiles.length,
    channels: channels.length,
    canTrace: host.state.canTrace,
    edges: async () => {
      const [first] = volumeChannels(host.state);
      const sources = first && (await host.service("volumes")?.sourcesOf(first.id));
      // The largest tile counts, since tiles at the specimen's edges have fewer voxels.
      const sizes = [...(sources?.values() ?? [])].map(({ volume }) =>
        volume.levels.map(({ size }) => Math.max(...size)),
      );
      const [largest = []] = sizes.sort((a, b) => b[0] - a[0]);
      return [...new Set(largest)].sort((a, b) => a - b);
    },
    limit: (edge) => display.limitEdge(edge),
    show: (mode) => {
      // Dwell is off, because a resting head would select a tile. High quality makes frames comparable.
      host.dispatch(setTo(DWELL, false));
      host.dispatch(setTo(QUALITY, "high"));
      host.dispatch(setTo(MODE, MODES[mode]));
      host.dispatch(setTo(SWITCH_DISTANCE, ALWAYS_NEAR_M));
    },
    settled: () => display.settled(),
    stand: () => {
      const { head } = viewpoint;
      const eye = new Vector3().setFromMatrixPosition(head).toArray();
      const isFlat = stereo.kind === null;
      return { eye, middle: isFlat ? [0, 0, 0] : ahead(head, XR_DISTANCE_M).toArray() };
    },
    fly: (specimen) => viewpoint.lookFrom({ ...viewpoint.cameraPose, specimen }),
    nextFrame: () => display.nextFrame(),
    cost: () => {
      const { drawCalls, triangles, volumeBytes } = display.snapshot();
      return { drawCalls, triangles, volumeBytes };
    },
    settings: () => display.snapshot().settings,
    endStereo: async () => {
      if (stereo.kind === null) return;
      stereo.end();
      await display.nextFrame();
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
