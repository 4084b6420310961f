// Sums the light of a small traced picture, and of the marched picture of the same view, over all pixels,
// into one texel. The weight of earlier sums fades.
precision highp float;

uniform sampler2D uSums;  // as path_trace.frag.glsl writes them, of one sample
uniform sampler2D uMoments;
uniform sampler2D uMarched;  // linear, premultiplied
uniform sampler2D uTracedBefore;
uniform sampler2D uMarchedBefore;
uniform float uKept;  // 0..1: share of the earlier sums
uniform float uOcclusion;  // see mean.frag.glsl

layout(location = 0) out vec4 oTraced;
layout(location = 1) out vec4 oMarched;

// Number of samples of the ray-marched frame along each edge of a traced pixel.
const int TAPS = 2;

void main() {
  oTraced = uKept * texelFetch(uTracedBefore, ivec2(0), 0);
  oMarched = uKept * texelFetch(uMarchedBefore, ivec2(0), 0);
  ivec2 size = textureSize(uSums, 0);
  vec2 marched = vec2(textureSize(uMarched, 0));
  for (int i = 0; i < size.x * size.y; i++) {
    ivec2 at = ivec2(i % size.x, i / size.x);
    vec4 light = texelFetch(uSums, at, 0);
    float open = light.a > 0.0 ? texelFetch(uMoments, at, 0).w / light.a : 1.0;
    oTraced += vec4(light.rgb * mix(1.0, open, uOcclusion), light.a);
    for (int k = 0; k < TAPS * TAPS; k++) {
      vec2 place = (vec2(at) + (vec2(k % TAPS, k / TAPS) + 0.5) / float(TAPS)) / vec2(size);
      oMarched += texelFetch(uMarched, ivec2(place * marched), 0) / float(TAPS * TAPS);
    }
  }
}
