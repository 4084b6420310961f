// Insertions into the vertex shader of three.js's standard material. A part may declare functions
// for some surfaces, move `transformed`, and change `gl_Position` at the end.
#insert start
varying vec3 vScene;
varying vec2 vReflected;  // three.js's scale and bias of light that a rough surface reflects
uniform sampler2D dfgLUT;
uniform float roughness;
#include <chunks/both_eyes_vertex>
#include <part/vertex_declared>

#insert before <project_vertex>
	#include <part/vertex_place>

#insert after <project_vertex>
	vScene = (modelMatrix * vec4(transformed, 1.0)).xyz;
#ifndef FLAT_SHADED
	float cosine = abs(dot(normalize(transformedNormal), normalize(mvPosition.xyz)));
	vReflected = texture2D(dfgLUT, vec2(max(roughness, 0.045), cosine)).rg;
#endif
	toEachEye(mvPosition);
	#include <part/vertex_end>
