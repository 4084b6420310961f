// The backdrop of the specimen on a flat screen: a background that grows lighter upwards, a pool of
// light on the ground, and the specimen's soft shadow in it.
precision highp float;

uniform vec3 uFar;  // sRGB: far away on the ground
uniform vec3 uHigh;  // sRGB: high up
uniform vec3 uPool;  // sRGB: on the ground beside the specimen
uniform float uShade;  // share of the light that the shadow takes, 0 to 1
uniform vec4 uFoot;  // x and z range of what stands on the ground, metres of the scene: low, high
uniform float uGround;  // height of the ground, metres
uniform vec3 cameraPosition;

in vec3 vRay;
out vec4 oColor;

#include <chunks/decode_srgb>

void main() {
  vec3 ray = normalize(vRay);
  vec3 color = mix(uFar, uHigh, smoothstep(-0.5, 0.5, ray.y));
  float height = cameraPosition.y - uGround;
  if (height > 0.0 && ray.y < 0.0) {
    vec2 size = 0.5 * (uFoot.zw - uFoot.xy);
    vec2 off = abs(cameraPosition.xz - ray.xz * height / ray.y - 0.5 * (uFoot.xy + uFoot.zw));
    float blur = 0.5 * max(size.x, size.y) + 0.01;
    vec2 share = 1.0 - smoothstep(size - blur, size + blur, off);
    float far = length(off) / (6.0 * blur);
    color = mix(color, uPool, exp(-far * far)) * (1.0 - uShade * share.x * share.y);
  }
  // dithering: a gradient of few steps of 8 bits would show as bands
  float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
  oColor = vec4(decoded(color + (noise - 0.5) / 255.0), 1.0);
}
