// Light gathered by polynomials, in the terms that field_gathering.glsl asks for.

#include "polynomials.glsl"
#include "field_gathering.glsl"
