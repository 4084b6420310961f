/**
 * Keeps objects that are not part of the specimen from being clipped in the depth pass. The depth
 * pass draws everything opaque with one material, which is clipped like the specimen. An unclipped
 * object that was clipped there would let a volume behind it show through.
 */
import { type Material, type Mesh, ShaderMaterial } from "three";

type Count = { value: number };

function countOf(material: Material): Count | null {
  if (!(material instanceof ShaderMaterial)) return null;
  return (material.uniforms.uCutCount as Count | undefined) ?? null;
}

export function keepUnclipped(mesh: Mesh): void {
  let count = 0;
  mesh.onBeforeRender = (_renderer, _scene, _camera, _geometry, material) => {
    const uniform = countOf(material);
    if (uniform === null) return;
    count = uniform.value;
    setCount(material, uniform, 0);
  };
  mesh.onAfterRender = (_renderer, _scene, _camera, _geometry, material) => {
    const uniform = countOf(material);
    if (uniform !== null) setCount(material, uniform, count);
  };
}

/**
 * three.js uploads a material's uniforms once for all its objects, unless `uniformsNeedUpdate` is
 * set.
 */
function setCount(material: Material, uniform: Count, value: number): void {
  if (uniform.value === value) return;
  uniform.value = value;
  if (material instanceof ShaderMaterial) material.uniformsNeedUpdate = true;
}
