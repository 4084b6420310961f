/**
 * Whether a frame needs anti-aliasing. Images that cover the whole frame have no edges, and drawing
 * them into a multisampled target takes a tenth of a frame of volumes in software.
 */
import { Line, Mesh, type Object3D, Sprite } from "three";

const covering = new WeakSet<Object3D>();

/** Declares that an object covers the whole frame wherever it is drawn. */
export function declareCovering(object: Object3D): void {
  covering.add(object);
}

/** Whether a scene shows anything that does not cover the whole frame. */
export function hasEdges(scene: Object3D): boolean {
  if (!scene.visible) return false;
  const isDrawn = scene instanceof Mesh || scene instanceof Line || scene instanceof Sprite;
  return (isDrawn && !covering.has(scene)) || scene.children.some(hasEdges);
}
