/**
 * The pass for the depth draws all that is opaque in one material, which is cut as the specimen is.
 * What is no part of the specimen must stay whole there, or a volume behind it would show through.
 */
import { type Material, type Mesh, ShaderMaterial } from "three";

type Count = { value: number };

function countOf(material: Material): Count | null {
  if (!(material instanceof ShaderMaterial)) return null;
  return (material.uniforms.uCutCount as Count | undefined) ?? null;
}

export function leaveUncut(mesh: Mesh): void {
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

/** three uploads a material's uniforms once for all its objects, unless the caller forces it. */
function setCount(material: Material, uniform: Count, value: number): void {
  if (uniform.value === value) return;
  uniform.value = value;
  if (material instanceof ShaderMaterial) material.uniformsNeedUpdate = true;
}
