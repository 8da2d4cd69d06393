// Folding of cached terms at every pixel of a box.

uniform sampler2D terms[QUADS];     // four terms each, written by `shade.frag`
uniform ivec2 origin;               // of the box, pixels of the tile
uniform vec4 weights[QUADS * SPECTRA * 3];  // X, Y, Z of every four terms for each spectrum

layout(location = 0) out vec4 pictures[SPECTRA];

void main() {
    vec3 total[SPECTRA];
    for (int k = 0; k < SPECTRA; ++k) total[k] = vec3(0.0);
    for (int quad = 0; quad < QUADS; ++quad) {
        vec4 term = texelFetch(terms[quad], ivec2(gl_FragCoord.xy) - origin, 0);
        for (int k = 0; k < SPECTRA; ++k) {
            int at = (quad * SPECTRA + k) * 3;
            total[k] += vec3(dot(term, weights[at]), dot(term, weights[at + 1]), dot(term, weights[at + 2]));
        }
    }
    for (int k = 0; k < SPECTRA; ++k) pictures[k] = vec4(total[k], 0.0);
}
