// Spectrum of a pixel as COEFFICIENTS of a basis, or samples, folded per pixel. For comparison only.

#include "sample.glsl"
#include "terms.glsl"

uniform sampler2D seen;
uniform sampler2D angles;
uniform sampler2D weights;      // each coefficient of every four terms
uniform sampler2D fold;         // X, Y and Z of every four coefficients
uniform int samples;
uniform int rows;

out vec4 picture;

void main() {
    vec4 spectrum[QUADS];
    for (int k = 0; k < QUADS; ++k) spectrum[k] = vec4(0.0);
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
            for (int k = 0; k < QUADS; ++k) {
                spectrum[k] += vec4(
                    dot(term, texelFetch(weights, ivec2(4 * k, row), 0)),
                    dot(term, texelFetch(weights, ivec2(4 * k + 1, row), 0)),
                    dot(term, texelFetch(weights, ivec2(4 * k + 2, row), 0)),
                    dot(term, texelFetch(weights, ivec2(4 * k + 3, row), 0)));
            }
        }
    }
    vec3 xyz = vec3(0.0);
    for (int k = 0; k < QUADS; ++k) {
        xyz += vec3(
            dot(spectrum[k], texelFetch(fold, ivec2(0, k), 0)),
            dot(spectrum[k], texelFetch(fold, ivec2(1, k), 0)),
            dot(spectrum[k], texelFetch(fold, ivec2(2, k), 0)));
    }
    picture = vec4(xyz, 0.0);
}
