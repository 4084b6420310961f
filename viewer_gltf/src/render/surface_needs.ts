/**
 * Leaves code out of a surface's shader while nothing needs it. Most of the time nothing is cut.
 * The code of cut faces took a quarter of a frame on a software renderer, which runs both sides of a
 * branch. A shader without `discard` also lets a GPU skip hidden surfaces before it shades them.
 *
 * The defines are:
 * - BOTH_EYES: two eyes see the frame, and fragments can reach into the other eye's part.
 * - CUT: clip planes or slices remove parts of surfaces.
 * - OPEN: a tile is drawn as a volume, and its neighbours' surfaces end at its faces.
 * - ROUGH: the surface is rough and no metal, so a polynomial replaces three.js's table of reflected
 *   light.
 */
import type { Material, MeshStandardMaterial, Vector4 } from "three";
import type { BothEyesUniforms } from "../gpu/both_eyes";
import type { Cuts } from "../gpu/clip_planes";
import { CORNER_PLANES } from "../gpu/clip_uniforms";

type NeededBy = Pick<Cuts, "uCuts" | "uCutCount" | "uOpen"> & Pick<BothEyesUniforms, "uIsForBoth">;

type Need = "BOTH_EYES" | "CUT" | "OPEN";

function needs({ uCuts, uCutCount, uOpen, uIsForBoth }: NeededBy): Record<Need, boolean> {
  const corner = uCuts.value.slice(-CORNER_PLANES);
  const isThere = ({ x, y, z }: Vector4) => x !== 0 || y !== 0 || z !== 0;
  return {
    BOTH_EYES: uIsForBoth.value,
    CUT: uCutCount.value > 0 || corner.every(isThere),
    OPEN: uOpen.value.some(isThere),
  };
}

/** Least roughness for which the polynomial in chunks/reflected_share holds. */
const ROUGH = 0.5;

/** Sets the define of a rough material. Roughness and metalness must not change afterwards. */
export function defineRough(material: MeshStandardMaterial): void {
  const { roughness, metalness, roughnessMap, metalnessMap } = material;
  const isPlain = roughnessMap === null && metalnessMap === null;
  if (!isPlain || roughness < ROUGH || metalness > 0) return;
  material.defines = { ...material.defines, ROUGH: "" };
}

/**
 * Keeps a material's defines up to date from draw to draw. Call it after the material was adopted
 * by BothEyes, which sets `uIsForBoth` before each draw.
 */
export function defineNeeds(material: Material, uniforms: NeededBy): void {
  const { onBeforeRender } = material;
  material.onBeforeRender = (...drawn) => {
    onBeforeRender.apply(material, drawn);
    material.defines ??= {};
    const { defines } = material;
    for (const [name, isNeeded] of Object.entries(needs(uniforms))) {
      if (isNeeded === name in defines) continue;
      if (isNeeded) defines[name] = "";
      else delete defines[name];
      material.needsUpdate = true; // three.js keeps the programs of earlier defines
    }
  };
}
