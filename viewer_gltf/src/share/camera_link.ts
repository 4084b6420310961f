/** Writes and reads the camera in an address, in metres of the scene. Pure. */

import { LARGEST_SCALE, SMALLEST_SCALE } from "../math/grab";
import type { CameraView, SpecimenPlacement } from "../state/camera_view";
import { readNumbers, written } from "./numbers";

/** Largest coordinate in the scene, m; the user would not find a specimen beyond it. */
const FARTHEST_M = 100;
/** Smallest distance between a camera and its target, m; closer together, they define no direction. */
const NEAREST_M = 1e-4;

/** Returns the parameter `eye`, and `pose` if the specimen was moved. */
export function writeCamera({ position, target, specimen }: CameraView): Record<string, string> {
  const eye = written([...position, ...target]);
  if (specimen === null) return { eye };
  const pose = written([...specimen.position, ...specimen.orientation, specimen.scale]);
  return { eye, pose };
}

/** Reads a camera; null if it can't be read, or would not show anything. */
export function readCamera(eye: string, pose: string | null): CameraView | null {
  const camera = readNumbers(eye, 6);
  const specimen = pose === null ? null : readSpecimen(pose);
  if (camera === null || (pose !== null && specimen === null)) return null;
  const [px, py, pz, tx, ty, tz] = camera;
  const isBlind = Math.hypot(px - tx, py - ty, pz - tz) < NEAREST_M;
  if (isBlind || !areInScene(camera)) return null;
  return { position: [px, py, pz], target: [tx, ty, tz], specimen };
}

function readSpecimen(pose: string): SpecimenPlacement | null {
  const values = readNumbers(pose, 8);
  if (values === null) return null;
  const [x, y, z, qx, qy, qz, qw, size] = values;
  const length = Math.hypot(qx, qy, qz, qw);
  if (!(length > 0.5) || !(size > 0) || !areInScene([x, y, z])) return null;
  return {
    position: [x, y, z],
    orientation: [qx / length, qy / length, qz / length, qw / length],
    scale: Math.min(Math.max(size, SMALLEST_SCALE), LARGEST_SCALE),
  };
}

function areInScene(values: readonly number[]): boolean {
  return values.every((value) => Math.abs(value) <= FARTHEST_M);
}
