// ΔE of two images under one white, for pixels fully covered in both and lit in one; -1 elsewhere.

#include "differences.glsl"

uniform sampler2D reference;    // XYZ and coverage
uniform sampler2D sampled;
uniform mat3 same_white;        // from the sample's white to the reference's
uniform vec3 white;             // of the reference
uniform float full_coverage;

layout(location = 0) out float difference;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 first = texelFetch(reference, at, 0), second = texelFetch(sampled, at, 0);
    difference = -1.0;
    if (min(first.w, second.w) < full_coverage || (first.xyz == vec3(0.0) && second.xyz == vec3(0.0))) return;
    vec3 share = first.xyz / white, other = same_white * second.xyz / white;
#if FORMULA == 1994
    difference = difference_1994(lab_from_shares(share), lab_from_shares(other));
#elif FORMULA == 2000
    difference = difference_2000(lab_from_shares(share), lab_from_shares(other));
#else
    difference = difference_cam16(share, other);
#endif
    if (isnan(difference)) difference = NO_NUMBER;
}
