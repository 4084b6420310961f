// Insertions into the fragment shader of three.js's standard material. A part may declare functions
// for some surfaces and change `diffuseColor`.
#insert start
varying vec2 vReflected;
#include <surface>
#include <part/fragment_declared>

#insert after <color_fragment>
	#include <part/fragment_color>
#ifdef BOTH_EYES
	keepToOwnEye();
#endif
#ifdef CUT
	if (isCut(vScene)) discard;
#endif
#ifndef OPAQUE
	if (isGone(vScene)) discard;
#endif

#insert after <normal_fragment_maps>
#if defined(CUT) || defined(OPEN)
	if (!gl_FrontFacing) normal = insideNormal(normal, cameraPosition);
#endif

// three.js looks up the light that a rough surface reflects for each fragment, which took a fifth of
// a frame on a software renderer. Within the next chunk its call returns the value from the vertices.
#insert before <lights_fragment_begin>
#ifndef FLAT_SHADED
#undef texture2D
#define texture2D(table, at) vec4(vReflected, 0.0, 0.0)
#endif

#insert after <lights_fragment_begin>
#undef texture2D
#define texture2D texture

#insert before <dithering_fragment>
#ifndef OPAQUE
	gl_FragColor = blended(gl_FragColor, diffuseColor.a);
#endif
