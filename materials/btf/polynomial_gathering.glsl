// What polynomials gather, as field_gathering.glsl asks for it.

uniform ivec2 size;

#include "polynomials.glsl"
#include "field_gathering.glsl"
