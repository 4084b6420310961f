// The vertex positions of a label map's surfaces, for the vertex shader of surfaces.
attribute float object_row;  // the row of the object in its table
attribute vec3 object_outwards;  // the direction out of the object, the same for all vertices in one place
attribute float _paint;  // intensity of the painted stain; 0 where a mesh has none
flat varying float vObject;
varying float vStain;
uniform sampler2D uFlags;
uniform float uInset;
uniform sampler2D uMiddles;
uniform mat4 uUmToScene;
uniform float uGap;
#include <chunks/object_texel>
#include <chunks/object_gap>

// Position of a vertex after the inset into its object and the shrinking by the gap.
vec3 objectPlace(vec3 place) {
  vObject = object_row;
  vStain = _paint;
  vec3 inset = place - uInset * object_outwards;
  vec4 middle = objectMiddle(uMiddles, object_row);
  return objectDrawnIn(inset, modelMatrix, uUmToScene, middle, uGap);
}

// Moves the vertices of a hidden object to one point outside the view, where its triangles have no area.
vec4 objectEnd(vec4 seen) {
  return objectTexel(uFlags, object_row) == 0 ? vec4(2.0, 2.0, 2.0, 1.0) : seen;
}
