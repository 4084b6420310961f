// Insertions into the fragment shaders of three.js's own materials.
#insert start
#include <chunks/both_eyes_fragment>

#insert main_start
	keepToOwnEye();
