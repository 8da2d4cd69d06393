// Kept terms at every pixel of a box, folded.

#include "fold.glsl"

uniform sampler2D terms[QUADS];     // four terms each, as `shade.frag` kept them
uniform ivec2 origin;               // of the box, pixels of the tile
uniform int first_row;              // of the weights' rows of four terms

layout(location = 0) out vec4 pictures[SPECTRA];

void main() {
    vec3 total[SPECTRA];
    for (int k = 0; k < SPECTRA; ++k) total[k] = vec3(0.0);
    for (int quad = 0; quad < QUADS; ++quad) {
        vec4 term = texelFetch(terms[quad], ivec2(gl_FragCoord.xy) - origin, 0);
        for (int k = 0; k < SPECTRA; ++k) total[k] += folded(term, 0, first_row + quad, k);
    }
    for (int k = 0; k < SPECTRA; ++k) pictures[k] = vec4(total[k], 0.0);
}
