// Insertions into the vertex shader of three.js's standard material. A part may declare functions
// for some surfaces, move `transformed`, and change `gl_Position` at the end.
#insert start
varying vec3 vScene;
#include <chunks/both_eyes_vertex>
#include <part/vertex_declared>

#insert before <project_vertex>
	#include <part/vertex_place>

#insert after <project_vertex>
	vScene = (modelMatrix * vec4(transformed, 1.0)).xyz;
	toEachEye(mvPosition);
	#include <part/vertex_end>
