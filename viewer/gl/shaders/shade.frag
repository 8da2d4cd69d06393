// One summand of one part's material under one light at every pixel: sum over samples, mixed palette entries and terms.
// With QUADS the terms of a box of pixels are written, four per target, for `fold.frag`; else they are folded directly.
// Four spectra cost little more than one, since a spectrum adds three numbers per term.

#include "sample.glsl"
#include "terms.glsl"
#ifndef QUADS
#include "fold.glsl"
#endif

uniform sampler2D seen;         // triangle index + 1 at every sample
uniform sampler2D angles;       // io or hd, with the factor of the terms
uniform sampler2D azimuth;
#ifdef MIPMAPPED
uniform sampler2D spans;        // footprint of a sample in each angle, radians
#endif
#ifdef USES_UV
uniform sampler2D uv;
uniform sampler2D footprint;
#endif
uniform ivec2 part;             // first and last triangle index + 1 of the part
uniform int samples;            // along a side of a pixel
uniform ivec2 some_samples;     // range of a pixel's samples: first, and one past the last
#ifdef QUADS
uniform ivec2 origin;           // of the box, pixels of the tile
uniform int first_row;          // of the rows of four terms
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
    for (int n = some_samples.x; n < some_samples.y; ++n) {
        ivec2 sample_at = corner + ivec2(n % samples, n / samples);
        int number = int(texelFetch(seen, sample_at, 0).x);
        if (number < part.x || number > part.y) continue;
        Sample s;
        s.angles = texelFetch(angles, sample_at, 0);
        if (s.angles.w == 0.0) continue;
        s.azimuths = texelFetch(azimuth, sample_at, 0).xy;
#ifdef MIPMAPPED
        s.span = texelFetch(spans, sample_at, 0);
#endif
#ifdef USES_UV
        s.uv = texelFetch(uv, sample_at, 0).xy;
        vec4 steps = texelFetch(footprint, sample_at, 0);
        s.footprint = mat2(steps.xy, steps.zw);
#endif
        Here here = here_at(s);
#ifdef QUADS
        for (int row = 0; row < rows; ++row) total[row] += term(here, 0, first_row + row);
#else
        for (int mixed = 0; mixed < MIXED; ++mixed) {
            int of = entry(here, mixed);
            for (int row = first_row; row < first_row + rows; ++row) {
                vec4 four = term(here, mixed, row);
                for (int k = 0; k < SPECTRA; ++k) total[k] += folded(four, of, row, k);
            }
        }
#endif
    }
#ifdef QUADS
    for (int k = 0; k < QUADS; ++k) terms[k] = total[k];
#else
    for (int k = 0; k < SPECTRA; ++k) pictures[k] = vec4(total[k], 0.0);
#endif
}
