// Lay the marched picture over the scene. Within the disc, where it takes the place of surfaces
// (CROSSING), by as much as the disc shows there: the surfaces themselves do the same.
precision highp float;

#ifdef CROSSING
uniform bool uIsCrossing;
uniform mat4 uToRoom[2];  // each eye's, from clip space
uniform vec3 uEyeAt[2];  // m
uniform float uRim;  // m: what no surface covers is weighed as if it lay so far
uniform vec3 uApex;
uniform vec3 uAxis;
uniform vec2 uDisc;
#include <chunks/focus_disc>
#endif

out vec4 oColor;

#ifdef ENCODED
#include <chunks/decode_srgb>
#endif
#include <chunks/marched_light>

void main() {
  oColor = marchedLight(gl_FragCoord.xy);
#ifdef CROSSING
  if (!uIsCrossing) return;
  int i = eyeAt(gl_FragCoord.xy);
  vec2 at = 2.0 * (gl_FragCoord.xy - uEyes[i].xy) / uEyes[i].zw - 1.0;
  vec4 far = uToRoom[i] * vec4(at, 1.0, 1.0);
  vec3 dir = normalize(far.xyz / far.w - uEyeAt[i]);
  oColor *= discWeight(uEyeAt[i] + uRim * dir, uApex, uAxis, uDisc);
#endif
}
