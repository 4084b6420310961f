// The picture's light, encoded for the screen.
precision highp float;

uniform sampler2D uLight;  // linear

out vec4 oColor;

#include <chunks/encode_srgb>
#include <chunks/within_gamut>

void main() {
  oColor = vec4(encoded(withinGamut(texelFetch(uLight, ivec2(gl_FragCoord.xy), 0).rgb)), 1.0);
}
