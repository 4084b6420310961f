// One round of an edge-avoiding a-trous wavelet (Dammertz et al., HPG 2010): mix pixels that lie
// `uGap` apart, as far as distance, coverage and brightness show that they are alike, each as
// exactly as so few samples allow. The more a pixel has gathered, the more it keeps of its own.
precision highp float;

uniform sampler2D uColor;
uniform sampler2D uGuide;
uniform int uGap;
uniform vec4 uPart;  // the eye's

layout(location = 0) out vec4 oColor;

// Samples: from so few on a pixel keeps a part, with so many all.
const float FEW = 16.0;
const float ENOUGH = 192.0;
const float DEPTH_SLACK = 0.01;  // of the box's longest edge

float luminanceOf(vec3 c) {
  return dot(c, vec3(0.2126, 0.7152, 0.0722));
}

// What no neighbour is like is an outlier of so few samples: a pixel that meets something where all others
// meet nothing, or the other way round, becomes as they are; one that is darker or brighter than all
// others becomes as dark or as bright as they are.
vec4 withinNeighbours(vec4 here, vec4 guide, ivec2 at, ivec2 low, ivec2 high) {
  float least = 1e9;
  float most = 0.0;
  int alike = 0;
  vec4 sum = vec4(0.0);
  float total = 0.0;
  for (int k = 0; k < 9; k++) {
    if (k == 4) continue;
    ivec2 tap = clamp(at + ivec2(k % 3 - 1, k / 3 - 1), low, high);
    vec4 other = texelFetch(uGuide, tap, 0);
    if (other.y <= 0.0) continue;
    vec4 there = texelFetch(uColor, tap, 0);
    if ((other.x > 0.0) == (guide.x > 0.0)) alike++;
    float luminance = luminanceOf(there.rgb);
    least = min(least, luminance);
    most = max(most, luminance);
    sum += there;
    total += 1.0;
  }
  if (total < 8.0) return here;  // their turn is yet to come
  float certain = smoothstep(FEW, ENOUGH, guide.y);
  if (alike == 0) return mix(sum / total, here, certain);
  if (guide.x <= 0.0) return here;
  float luminance = luminanceOf(here.rgb);
  float wanted = clamp(luminance, least, most);
  vec3 color = luminance > 1e-4 ? here.rgb * wanted / luminance : vec3(wanted);
  return vec4(mix(color, here.rgb, certain), here.a);
}

void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 here = texelFetch(uColor, at, 0);
  vec4 guide = texelFetch(uGuide, at, 0);
  if (guide.y >= ENOUGH || guide.y <= 0.0) {
    oColor = here;
    return;
  }
  ivec2 low = ivec2(uPart.xy);
  ivec2 high = ivec2(uPart.xy + uPart.zw) - 1;
  if (uGap == 1) here = withinNeighbours(here, guide, at, low, high);
  float weights[3] = float[](0.375, 0.25, 0.0625);
  vec4 sum = vec4(0.0);
  float total = 0.0;
  for (int y = -2; y <= 2; y++) {
    for (int x = -2; x <= 2; x++) {
      ivec2 tap = clamp(at + uGap * ivec2(x, y), low, high);
      vec4 there = texelFetch(uColor, tap, 0);
      vec4 other = texelFetch(uGuide, tap, 0);
      // as much may differ as the noise of so few samples explains
      float noise = inversesqrt(max(min(guide.y, other.y), 1.0));
      float bright = 4.0 * max(guide.z, other.z)
        + 0.5 * noise * (luminanceOf(here.rgb) + luminanceOf(there.rgb)) + 1e-3;
      float apart = abs(other.x - guide.x) / (DEPTH_SLACK * (1.0 + 4.0 * noise * noise));
      if ((other.x > 0.0) != (guide.x > 0.0)) apart = 2.0;
      float unlike = abs(luminanceOf(there.rgb) - luminanceOf(here.rgb)) / bright;
      float weight = weights[abs(x)] * weights[abs(y)] * exp(-apart * apart - unlike);
      if (other.y <= 0.0) weight = 0.0;  // it has not had its turn yet
      sum += weight * there;
      total += weight;
    }
  }
  oColor = mix(sum / total, here, smoothstep(FEW, ENOUGH, guide.y));
}
