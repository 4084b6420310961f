// The volume's box, a unit cube around the origin that modelViewMatrix transforms into the eye's
// space. Its back faces are drawn, so that there is a ray even if the eye is inside.
uniform vec3 uSize;  // um, edges of the box

centroid out vec3 vPosition;  // um, from the box's low corner
flat out vec3 vEye;  // um, from the box's low corner: the eye
flat out vec3 vLight;  // unit vector towards the lamp, in the axes of the box
flat out vec3 vFill;  // unit vector towards the fill light
flat out vec3 vUp;  // unit vector towards the sky
flat out vec2 vDepth;  // third row of the projection: clip z = x * view z + y
centroid out float vViewZ;

uniform vec3 uLight;  // towards the lamp, in the eye's space
uniform vec3 uFill;  // towards the fill light, in the eye's space

void main() {
  vec4 view = modelViewMatrix * vec4(position, 1.0);
  mat4 toBox = inverse(modelViewMatrix);
  vPosition = (position + 0.5) * uSize;
  vEye = ((toBox * vec4(0.0, 0.0, 0.0, 1.0)).xyz + 0.5) * uSize;
  vLight = normalize((toBox * vec4(uLight, 0.0)).xyz * uSize);
  vFill = normalize((toBox * vec4(uFill, 0.0)).xyz * uSize);
  vUp = normalize((toBox * vec4(viewMatrix[1].xyz, 0.0)).xyz * uSize);
  vDepth = vec2(projectionMatrix[2][2], projectionMatrix[3][2]);
  vViewZ = view.z;
  gl_Position = projectionMatrix * view;
}
