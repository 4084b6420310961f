// Two marched images. Where blocks were skipped, each pixel becomes the mean of its neighbours that
// were marched, so that noise does not flicker at the edge of the field of view.
precision highp float;

uniform sampler2D uFirst;
uniform sampler2D uSecond;
uniform vec4 uPart;  // the eye's part of the images: x, y, width, height, pixels

#include <chunks/periphery>

layout(location = 0) out vec4 oFirst;
layout(location = 1) out vec4 oSecond;

bool isWithin(ivec2 pixel) {
  vec2 at = vec2(pixel) - uPart.xy;
  return all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, uPart.zw));
}

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  oFirst = texelFetch(uFirst, pixel, 0);
  oSecond = texelFetch(uSecond, pixel, 0);
  if (!isSparse(pixel, uPart)) return;
  oFirst = oSecond = vec4(0.0);
  float total = 0.0;
  // A reach of 2 is needed in the corners of the part.
  for (int reach = 1; reach < 3 && total == 0.0; reach++) {
    for (int k = 0; k < 9; k++) {
      ivec2 side = ivec2(k % 3, k / 3) - 1;
      ivec2 tap = pixel + reach * side;
      if (!isWithin(tap) || isLeftOut(tap, uPart)) continue;
      float weight = float((2 - abs(side.x)) * (2 - abs(side.y)));
      oFirst += weight * texelFetch(uFirst, tap, 0);
      oSecond += weight * texelFetch(uSecond, tap, 0);
      total += weight;
    }
  }
  oFirst /= max(total, 1.0);
  oSecond /= max(total, 1.0);
}
