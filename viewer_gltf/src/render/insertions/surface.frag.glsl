// Insertions into the fragment shader of three.js's standard material. A part may declare functions
// for some surfaces and change `diffuseColor`.
#insert start
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

// The scene has no environment that surfaces could mirror.
#insert before <lights_fragment_begin>
#undef RE_IndirectSpecular
#ifdef ROUGH
#undef texture2D
#define texture2D(table, at) vec4(reflectedShare(at), 0.0, 0.0)
#endif

#insert after <lights_fragment_begin>
#ifdef ROUGH
#undef texture2D
#define texture2D texture
#endif

#insert before <dithering_fragment>
#ifndef OPAQUE
	gl_FragColor = blended(gl_FragColor, diffuseColor.a);
#endif
