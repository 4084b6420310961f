// The volume's box, a unit cube around the origin that modelViewMatrix brings to the eye's space.
// Its back faces are drawn, so that the ray is there also when the eye is inside.
uniform vec3 uSize;  // um, edges of the box

centroid out vec3 vPosition;  // um, from the box's low corner
flat out vec3 vEye;  // um, the same space
flat out vec3 vLight;  // towards the lamp, the same space, unit length
flat out vec3 vFill;  // towards the weaker lamp
flat out vec3 vUp;  // towards the sky
flat out vec2 vDepth;  // third row of the projection: clip z = x * view z + y
centroid out float vViewZ;

uniform vec3 uLight;  // towards the lamp, space of the eye
uniform vec3 uFill;  // towards the weaker lamp

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
