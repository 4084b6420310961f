// Composites the marched image over the scene. In the disc, where it replaces surfaces (CROSSING),
// it is weighted by the disc; the surfaces' own shaders do the same.
precision highp float;

#ifdef CROSSING
uniform bool uIsCrossing;
uniform mat4 uToScene[2];  // from each eye's clip space to the scene
uniform vec3 uEyeAt[2];  // position of each eye in the scene, metres
uniform float uRim;  // metres: distance at which pixels without a surface are weighted
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
  if (oColor == vec4(0.0)) discard;  // saves the blending of all samples of the pixel
#ifdef CROSSING
  if (!uIsCrossing) return;
  int i = eyeAt(gl_FragCoord.xy);
  vec2 at = 2.0 * (gl_FragCoord.xy - uEyes[i].xy) / uEyes[i].zw - 1.0;
  vec4 far = uToScene[i] * vec4(at, 1.0, 1.0);
  vec3 dir = normalize(far.xyz / far.w - uEyeAt[i]);
  oColor *= discWeight(uEyeAt[i] + uRim * dir, uApex, uAxis, uDisc);
#endif
}
