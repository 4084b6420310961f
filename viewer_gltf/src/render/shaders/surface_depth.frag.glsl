// Writes depth only, clipped like the surfaces; with SHARED, only where some of the surface is
// left.
varying vec3 vScene;
#include <chunks/both_eyes_fragment>
#include <chunks/clip_planes>
#include <chunks/focus_disc>
#include <chunks/surface_share>
out vec4 oColor;

void main() {
  keepToOwnEye();
  if (isCut(vScene)) discard;
#ifdef SHARED
  if (isGone(vScene)) discard;
#endif
  oColor = vec4(0.0);
}
