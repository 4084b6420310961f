/** Paths of a video's camera: once around the specimen, or through saved views. In metres of the scene. Pure. */
import { CatmullRomCurve3, Spherical, Vector3 } from "three";
import type { KeptView } from "../state/kept_views";

/** Returns `count` views of a full turn around the target, at the same height. */
export function turntable({ position, target }: KeptView, count: number): readonly KeptView[] {
  const offset = new Vector3(...position).sub(new Vector3(...target));
  const start = new Spherical().setFromVector3(offset);
  return Array.from({ length: count }, (_, i) => {
    const theta = start.theta + (2 * Math.PI * i) / count;
    const at = new Vector3().setFromSpherical(new Spherical(start.radius, start.phi, theta));
    return { position: at.add(new Vector3(...target)).toArray(), target };
  });
}

/** Returns `count` views on a smooth path through at least two views, slower at both ends. */
export function pathThrough(views: readonly KeptView[], count: number): readonly KeptView[] {
  // Direction and distance are interpolated separately, so that the eye moves around the target, not through it.
  const targets = curve(views.map(({ target }) => new Vector3(...target)));
  const offsets = views.map(({ position, target }) =>
    new Vector3(...position).sub(new Vector3(...target)),
  );
  const directions = curve(offsets.map((offset) => offset.clone().normalize()));
  const distances = curve(offsets.map((offset) => new Vector3(Math.log(offset.length()), 0, 0)));
  return Array.from({ length: count }, (_, i) => {
    const t = count === 1 ? 0 : i / (count - 1);
    const eased = t * t * (3 - 2 * t);
    const target = targets.getPoint(eased);
    const away = Math.exp(distances.getPoint(eased).x);
    const direction = directions.getPoint(eased);
    if (direction.length() < 1e-6) direction.set(0, 0, 1); // opposite directions cancel out half-way
    const position = direction.setLength(away).add(target);
    return { position: position.toArray(), target: target.toArray() };
  });
}

function curve(points: Vector3[]): CatmullRomCurve3 {
  return new CatmullRomCurve3(points, false, "centripetal");
}
