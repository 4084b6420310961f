// Functions that surfaces call in addition to three.js's standard material.
// ../insertions/surface.frag.glsl has the calls.
varying vec3 vScene;
#include <chunks/both_eyes_fragment>
#include <chunks/clip_planes>
#include <chunks/open_tile>
#include <chunks/focus_disc>
#include <chunks/surface_share>
#include <chunks/marched_light>
#ifdef ROUGH
#include <chunks/reflected_share>
#endif

// Where a solid is cut open, or ends at the open tile, its inside is drawn flat, with the normal of
// the section.
vec3 insideNormal(vec3 normal, vec3 eye) {
  vec3 flatNormal = cutNormal(eye, vScene);
  if (flatNormal == vec3(0.0)) flatNormal = openNormal(eye, vScene);
  if (flatNormal == vec3(0.0)) return normal;
  return normalize((viewMatrix * vec4(flatNormal, 0.0)).xyz);
}

// Returns light multiplied by its opacity. At the disc's rim the surface and the volume are mixed:
// drawing one over the other would darken the rim.
vec4 blended(vec4 light, float alpha) {
  float taken = shareTaken(vScene);
  float own = uOpacity * alpha * (1.0 - taken);
  vec4 mixed = vec4(own * light.rgb, own);
  if (uCrosses && taken > 0.0) mixed += taken * marchedLight(gl_FragCoord.xy);
  return mixed;
}
