// Terms of polynomials, as field_texels.glsl asks for them.

#include "polynomials.glsl"
#include "field_texels.glsl"
