// RGB renderer with the same factors: three numbers per term, one image. For comparison only.

#include "sample.glsl"
#include "terms.glsl"

uniform sampler2D seen;
uniform sampler2D angles;
uniform sampler2D weights;      // red, green and blue of every four terms
uniform int samples;
uniform int rows;

out vec4 picture;

void main() {
    vec3 colour = vec3(0.0);
    ivec2 corner = ivec2(gl_FragCoord.xy) * samples;
    for (int n = 0; n < samples * samples; ++n) {
        ivec2 sample_at = corner + ivec2(n % samples, n / samples);
        if (texelFetch(seen, sample_at, 0).x == 0.0) continue;
        vec4 at = texelFetch(angles, sample_at, 0);
        if (at.w == 0.0) continue;
        at.z = min(at.z, 6.28318530717958648 - at.z);
        Place first = place_on(axes[0], at.x);
        Place second = place_on(axes[1], at.y);
        Place third = place_on(axes[2], at.z);
        for (int row = 0; row < rows; ++row) {
            vec4 term = look_up(first, row) * look_up(second, row) * look_up(third, row) * at.w;
            colour.r += dot(term, texelFetch(weights, ivec2(0, row), 0));
            colour.g += dot(term, texelFetch(weights, ivec2(1, row), 0));
            colour.b += dot(term, texelFetch(weights, ivec2(2, row), 0));
        }
    }
    picture = vec4(colour, 0.0);
}
