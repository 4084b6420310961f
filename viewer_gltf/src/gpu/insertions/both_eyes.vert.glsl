// Insertions into the vertex shaders of three.js's own materials: each of the two instances goes to
// its eye's part of the frame.
#insert start
#include <chunks/both_eyes_vertex>

#insert main_end
	toEachEye(mvPosition);
