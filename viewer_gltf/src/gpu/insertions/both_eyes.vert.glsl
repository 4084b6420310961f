// For the vertex shaders of three's own materials: each of two instances goes to its eye's part of the picture.
#insert start
#include <chunks/both_eyes_vertex>

#insert main_end
	toEachEye(mvPosition);
