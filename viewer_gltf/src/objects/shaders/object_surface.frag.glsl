// The colours of a label map's surfaces, for the fragment shader of surfaces.
flat varying float vObject;
varying float vStain;
uniform float uStained;
uniform vec3 uStain;
uniform sampler2D uFlags;
uniform sampler2D uColumn;
uniform sampler2D uColors;
uniform bool uIsColored;
#include <chunks/object_texel>
#include <chunks/object_light>
#include <chunks/object_stain>

// Linear colour of an object: that of its value in the column, mixed with the stain, lightened by its flag.
vec3 objectColor(vec3 own) {
  vec3 color = own;
  if (uIsColored) color = texelFetch(uColors, ivec2(objectTexel(uColumn, vObject), 0), 0).rgb;
  color = objectStain(color, uStain, uStained * vStain);
  return objectLight(color, objectTexel(uFlags, vObject));
}
