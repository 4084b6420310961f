// Combines both eyes' images into one, for red-cyan glasses; see dubois.ts.
precision highp float;

uniform sampler2D uEyes;  // sRGB; the left eye's image is the left half
uniform mat3 uLeft;
uniform mat3 uRight;

out vec4 oColor;

#include <chunks/decode_srgb>
#include <chunks/encode_srgb>

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  ivec2 other = at + ivec2(textureSize(uEyes, 0).x / 2, 0);
  vec3 left = decoded(texelFetch(uEyes, at, 0).rgb);
  vec3 right = decoded(texelFetch(uEyes, other, 0).rgb);
  oColor = vec4(encoded(clamp(uLeft * left + uRight * right, 0.0, 1.0)), 1.0);
}
