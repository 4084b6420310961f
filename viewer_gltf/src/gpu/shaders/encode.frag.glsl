// The frame's light, encoded for the screen. If the user's room shows through (SEE_THROUGH), the
// opacity is kept; the light is premultiplied by it. For a moment after a jump, a share of the
// earlier frame is mixed in.
precision highp float;

uniform sampler2D uLight;  // light of this frame, linear
uniform sampler2D uBefore;  // light of the frame before a jump, linear
uniform float uShareBefore;  // share of uBefore in the result, 0 to 1

out vec4 oColor;

#include <chunks/encode_srgb>
#include <chunks/within_gamut>

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 light = texelFetch(uLight, at, 0);
  if (uShareBefore > 0.0) light = mix(light, texelFetch(uBefore, at, 0), uShareBefore);
#ifdef SEE_THROUGH
  vec3 bare = light.rgb / max(light.a, 1e-4);
  oColor = vec4(light.a * encoded(withinGamut(bare)), light.a);
#else
  oColor = vec4(encoded(withinGamut(light.rgb)), 1.0);
#endif
}
