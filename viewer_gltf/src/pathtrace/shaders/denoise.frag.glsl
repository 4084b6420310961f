// One round of an edge-avoiding a-trous wavelet (Dammertz et al., HPG 2010). It mixes pixels that are `uGap` apart and
// similar in distance, coverage and brightness. The tolerance follows from the noise that few samples have. The more
// samples a pixel has, the more it keeps of its own colour.
precision highp float;

uniform sampler2D uColor;
uniform sampler2D uGuide;
uniform int uGap;
uniform vec4 uPart;  // the eye's part of the target: x, y, width, height, pixels

layout(location = 0) out vec4 oColor;

// Numbers of samples from which a pixel keeps a part of its own colour, and all of it.
const float FEW = 16.0;
const float ENOUGH = 192.0;
// tolerated difference in distance, as a share of the box's longest edge
const float DEPTH_SLACK = 0.01;

float luminanceOf(vec3 c) {
  return dot(c, vec3(0.2126, 0.7152, 0.0722));
}

// Removes outliers, which are pixels that differ from all their neighbours. If a pixel alone shows something, or alone
// shows nothing, it gets the neighbours' mean. If it is darker or brighter than all of them, its brightness is limited
// to their range.
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
  if (total < 8.0) return here;  // some neighbours have no samples yet
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
      // the tolerance covers the differences that noise explains at this number of samples
      float noise = inversesqrt(max(min(guide.y, other.y), 1.0));
      float bright = 4.0 * max(guide.z, other.z)
        + 0.5 * noise * (luminanceOf(here.rgb) + luminanceOf(there.rgb)) + 1e-3;
      float apart = abs(other.x - guide.x) / (DEPTH_SLACK * (1.0 + 4.0 * noise * noise));
      if ((other.x > 0.0) != (guide.x > 0.0)) apart = 2.0;
      float unlike = abs(luminanceOf(there.rgb) - luminanceOf(here.rgb)) / bright;
      float weight = weights[abs(x)] * weights[abs(y)] * exp(-apart * apart - unlike);
      if (other.y <= 0.0) weight = 0.0;  // the neighbour has no samples yet
      sum += weight * there;
      total += weight;
    }
  }
  oColor = mix(sum / total, here, smoothstep(FEW, ENOUGH, guide.y));
}
