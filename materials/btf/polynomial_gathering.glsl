// What polynomials gather, as field_gathering.glsl asks for it.

#include "polynomials.glsl"
#include "field_gathering.glsl"
