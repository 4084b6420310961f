// Noise of a tile of the frame: the mean of its pixels' standard errors of the luminance.
precision highp float;

uniform sampler2D uSums;
uniform sampler2D uMoments;

layout(location = 0) out vec4 oNoise;

const float UNSURE = 1e3;  // value for tiles with too few samples
const float ENOUGH = 16.0;

void main() {
  ivec2 first = ivec2(gl_FragCoord.xy) * NOISE_TILE;
  ivec2 size = textureSize(uSums, 0);
  float sum = 0.0;
  float count = 0.0;
  for (int y = 0; y < NOISE_TILE; y++) {
    for (int x = 0; x < NOISE_TILE; x++) {
      ivec2 at = first + ivec2(x, y);
      if (any(greaterThanEqual(at, size))) continue;
      vec4 moments = texelFetch(uMoments, at, 0);
      float n = moments.y;
      if (n < ENOUGH) {
        oNoise = vec4(UNSURE);
        return;
      }
      float mean = dot(texelFetch(uSums, at, 0).rgb, vec3(0.2126, 0.7152, 0.0722)) / n;
      sum += sqrt(max(moments.x / n - mean * mean, 0.0) / (n - 1.0));
      count += 1.0;
    }
  }
  oNoise = vec4(sum / max(count, 1.0));
}
