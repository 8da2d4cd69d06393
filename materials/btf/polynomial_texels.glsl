// Terms of polynomials, as field_texels.glsl asks for them.

uniform ivec2 size;

#include "polynomials.glsl"
#include "field_texels.glsl"
