// The picture's light, encoded for the screen. Where the room shows through (SEE_THROUGH), with its
// opacity, which its light is times already.
precision highp float;

uniform sampler2D uLight;  // linear

out vec4 oColor;

#include <chunks/encode_srgb>
#include <chunks/within_gamut>

void main() {
#ifdef SEE_THROUGH
  vec4 light = texelFetch(uLight, ivec2(gl_FragCoord.xy), 0);
  vec3 bare = light.rgb / max(light.a, 1e-4);
  oColor = vec4(light.a * encoded(withinGamut(bare)), light.a);
#else
  oColor = vec4(encoded(withinGamut(texelFetch(uLight, ivec2(gl_FragCoord.xy), 0).rgb)), 1.0);
#endif
}
