// The marched image at a pixel of the whole frame. If it was marched with fewer pixels, each pixel
// mixes the four around it, by nearness and by similarity of the scene's depth. So colour does not
// bleed across a surface's edge (joint bilateral upsampling, Kopf et al., SIGGRAPH 2007).
uniform sampler2D uMarched;  // premultiplied, linear; with ENCODED its colours are encoded
uniform highp sampler2D uSceneDepth;
uniform int uEyeCount;
uniform vec4 uEyes[2];  // each eye's part of the frame: x, y, width, height, pixels
uniform vec4 uParts[2];  // each eye's part of uMarched: x, y, width, height, pixels

// Difference of depths that count as similar, as a share of the depth's distance to the far plane.
const float ALIKE = 0.02;

int eyeAt(vec2 pixel) {
  return uEyeCount > 1 && pixel.x >= uEyes[1].x ? 1 : 0;
}

// Linear light of a pixel of uMarched.
vec4 lightAt(ivec2 pixel) {
  vec4 light = texelFetch(uMarched, pixel, 0);
#ifdef ENCODED
  if (light.a > 0.0) light.rgb = decoded(light.rgb / light.a) * light.a;
#endif
  return light;
}

vec4 marchedLight(vec2 pixel) {
  int i = eyeAt(pixel);
  vec4 eye = uEyes[i];
  vec4 part = uParts[i];
  vec2 scale = part.zw / eye.zw;
  if (scale == vec2(1.0)) return lightAt(ivec2(pixel - eye.xy + part.xy));
  float here = 1.0 - texelFetch(uSceneDepth, ivec2(pixel), 0).r;
  vec2 at = (pixel - eye.xy) * scale - 0.5;
  vec2 corner = floor(at);
  vec2 share = at - corner;
  vec4 sum = vec4(0.0);
  float total = 0.0;
  for (int k = 0; k < 4; k++) {
    vec2 side = vec2(k & 1, k >> 1);
    vec2 tap = clamp(corner + side, vec2(0.0), part.zw - 1.0);  // stays within this eye's part
    vec2 source = (tap + 0.5) / scale + eye.xy;
    float there = 1.0 - texelFetch(uSceneDepth, ivec2(source), 0).r;
    vec2 near = mix(1.0 - share, share, side);
    float alike = abs(there - here) <= ALIKE * max(there, here) ? 1.0 : 1e-3;
    float weight = (near.x * near.y + 1e-4) * alike;
    sum += weight * lightAt(ivec2(tap + part.xy));
    total += weight;
  }
  return sum / total;
}
