// Shows the frame from a view slightly beside the one from which its paths began: each pixel searches for its surface in
// the earlier view. The sums stay sharp, because only this last step interpolates between pixels.
precision highp float;

uniform sampler2D uColor;  // linear, premultiplied
uniform sampler2D uGuide;  // distance in lengths of the box's longest edge; 0: the pixel shows nothing
uniform float uEdge;  // um: longest edge of the box
uniform vec4 uPart;  // the eye's part of the target: x, y, width, height, pixels
uniform mat4 uToBox;  // the current view: from normalised device coordinates to um of the box
uniform vec3 uEyeAt;
// from um of the box to device coordinates of the view in which the paths began
uniform mat4 uFromBox;
uniform vec3 uEyeThere;
uniform float uAway;  // um, distance to the centre of the box

out vec4 oColor;

float hitDistanceAt(ivec2 pixel) {
  return uEdge * texelFetch(uGuide, pixel, 0).r;
}

#include <chunks/reproject_search>

void main() {
  vec2 at = gl_FragCoord.xy - uPart.xy;
  vec4 far = uToBox * vec4(2.0 * at / uPart.zw - 1.0, 1.0, 1.0);
  vec3 dir = normalize(far.xyz / far.w - uEyeAt);
  float away = uAway;
  bool isHit;
  vec2 there = seek(uEyeAt, dir, uFromBox, uEyeThere, uPart, away, isHit);
  ivec2 low = ivec2(uPart.xy);
  ivec2 high = ivec2(uPart.xy + uPart.zw) - 1;
  vec2 corner = floor(there - 0.5);
  vec2 share = there - 0.5 - corner;
  vec4 sum = vec4(0.0);
  for (int k = 0; k < 4; k++) {
    ivec2 side = ivec2(k & 1, k >> 1);
    vec2 near = mix(1.0 - share, share, vec2(side));
    ivec2 source = clamp(ivec2(corner) + side + low, low, high);
    sum += near.x * near.y * texelFetch(uColor, source, 0);
  }
  oColor = sum;
}
