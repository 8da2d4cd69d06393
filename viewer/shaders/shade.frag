// One pack of one part's material under one light, at every pixel: the mean over its samples of terms, which are factors
// times what arrives. With QUADS the terms of a box of pixels are kept, four a target, for `fold.frag`; else they are
// folded at once. Four spectra cost little more than one: a spectrum is three numbers a term.

#include "factors.glsl"
#ifndef QUADS
#include "fold.glsl"
#endif

uniform sampler2D seen;         // triangle number + 1 at every sample
uniform sampler2D angles;       // io or hd, with what the table is multiplied by
uniform sampler2D azimuth;
#ifdef MIPMAPPED
uniform sampler2D spans;        // radians of each angle that a sample stands for
#define PLACE Mean
#define PLACE_ON(number, angle) mean_on(number, angle, span[number])
#else
#define PLACE Place
#define PLACE_ON(number, angle) place_on(axes[number], angle)
#endif
uniform ivec2 part;             // first and last triangle number + 1 of the part
uniform int samples;            // along a side of a pixel
uniform int azimuth_channel;
#ifdef QUADS
uniform ivec2 origin;           // of the box, pixels of the tile
uniform int first_row;          // of the factors' rows of four terms
#define COUNT QUADS
#define VALUE vec4
layout(location = 0) out vec4 terms[COUNT];
#else
uniform int rows;
#define COUNT SPECTRA
#define VALUE vec3
layout(location = 0) out vec4 pictures[COUNT];
#endif

void main() {
    VALUE total[COUNT];
    for (int k = 0; k < COUNT; ++k) total[k] = VALUE(0.0);
#ifdef QUADS
    ivec2 corner = (ivec2(gl_FragCoord.xy) + origin) * samples;
    const int rows = QUADS;
#else
    ivec2 corner = ivec2(gl_FragCoord.xy) * samples;
    const int first_row = 0;
#endif
    for (int n = 0; n < samples * samples; ++n) {
        ivec2 sample_at = corner + ivec2(n % samples, n / samples);
        int number = int(texelFetch(seen, sample_at, 0).x);
        if (number < part.x || number > part.y) continue;
        vec4 at = texelFetch(angles, sample_at, 0);
        if (at.w == 0.0) continue;
#ifdef MIPMAPPED
        vec4 span = texelFetch(spans, sample_at, 0);
#endif
#if AXES == 3
        at.z = min(at.z, 6.28318530717958648 - at.z);
#else
        PLACE fourth = PLACE_ON(3, texelFetch(azimuth, sample_at, 0)[azimuth_channel]);
#endif
        PLACE first = PLACE_ON(0, at.x);
        PLACE second = PLACE_ON(1, at.y);
        PLACE third = PLACE_ON(2, at.z);
        for (int row = first_row; row < first_row + rows; ++row) {
            vec4 term = look_up(first, row) * look_up(second, row) * look_up(third, row) * at.w;
#if AXES == 4
            term *= look_up(fourth, row);
#endif
#ifdef QUADS
            total[row - first_row] += term;
#else
            for (int k = 0; k < SPECTRA; ++k) total[k] += folded(term, row, k);
#endif
        }
    }
#ifdef QUADS
    for (int k = 0; k < QUADS; ++k) terms[k] = total[k];
#else
    for (int k = 0; k < SPECTRA; ++k) pictures[k] = vec4(total[k], 0.0);
#endif
}
